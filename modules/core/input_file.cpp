#include "modules/core/input_file.hpp"

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <fstream>
#include <system_error>

namespace km {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kChunk_bytes = std::uintmax_t{1} << 20U;

[[noreturn]] void fail(const fs::path& file, const std::string& why) {
  throw InputFileError(file.string() + ": " + why);
}

[[noreturn]] void fail_as_too_large(const fs::path& file, std::uintmax_t max_bytes) {
  fail(file, "larger than " + std::to_string(max_bytes >> 20U) + " MiB, which no input is");
}

}  // namespace

std::string problem_of_file(const fs::path& file) {
  std::error_code error;
  const fs::file_status status = fs::status(file, error);
  switch (status.type()) {
    case fs::file_type::regular:
    case fs::file_type::fifo:
      return {};
    case fs::file_type::not_found:
      return "no such file";
    case fs::file_type::directory:
      return "a folder, not a file";
    default:
      return error ? error.message() : "not a file";
  }
}

bool is_file(const fs::path& path) noexcept {
  std::error_code ignored;
  return fs::is_regular_file(path, ignored);
}

bool is_folder(const fs::path& path) noexcept {
  std::error_code ignored;
  return fs::is_directory(path, ignored);
}

bool is_there(const fs::path& path) noexcept {
  std::error_code ignored;
  return fs::exists(path, ignored);
}

bool is_absent(const fs::path& path) noexcept {
  std::error_code ignored;
  return fs::status(path, ignored).type() == fs::file_type::not_found;
}

std::string read_input_file(const fs::path& file, std::uintmax_t max_bytes) {
  if (const std::string problem = problem_of_file(file); !problem.empty()) fail(file, problem);
  errno = 0;
  std::ifstream stream(file, std::ios::binary);
  if (!stream)
    fail(file,
         "cannot be opened" + (errno == 0 ? "" : ": " + std::generic_category().message(errno)));
  std::error_code unknown;  // of a pipe: what comes out of it is counted
  const std::uintmax_t size = fs::file_size(file, unknown);
  if (!unknown && size > max_bytes) fail_as_too_large(file, max_bytes);

  std::string bytes;
  if (!unknown) bytes.reserve(static_cast<std::size_t>(size));
  while (stream) {
    const std::size_t before = bytes.size();
    bytes.resize(before + static_cast<std::size_t>(std::min(kChunk_bytes, max_bytes + 1)));
    stream.read(bytes.data() + before, static_cast<std::streamsize>(bytes.size() - before));
    bytes.resize(before + static_cast<std::size_t>(stream.gcount()));
    if (bytes.size() > max_bytes) fail_as_too_large(file, max_bytes);
  }
  if (stream.bad()) fail(file, "cannot be read to its end");
  return bytes;
}

}  // namespace km
