#include "modules/core/io/input_file.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <system_error>

#include "modules/core/io/descriptor.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kChunk_bytes = std::size_t{1} << 16U;
constexpr int kPipe_ms = 10'000;  // longest wait for bytes of a pipe

[[noreturn]] void fail(const fs::path& file, const std::string& why) {
  throw InputFileError(file.string() + ": " + why);
}

[[noreturn]] void fail_as_too_large(const fs::path& file, std::uintmax_t max_bytes) {
  fail(file, "larger than " + std::to_string(max_bytes >> 20U) + " MiB, which no input is");
}

// Waits until the pipe has bytes, or its writer has closed it.
void await_pipe(int descriptor, const fs::path& file) {
  pollfd pipe{.fd = descriptor, .events = POLLIN, .revents = 0};
  int ready = 0;
  while ((ready = poll(&pipe, 1, kPipe_ms)) < 0 && errno == EINTR) {
  }
  if (ready == 0)
    fail(file,
         "a pipe into which no program has written for " + std::to_string(kPipe_ms / 1000) + " s");
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

std::vector<fs::path> entries_of(const fs::path& folder) {
  std::vector<fs::path> entries;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error))
    entries.push_back(entry->path());
  std::sort(entries.begin(), entries.end());
  return entries;
}

std::string read_input_file(const fs::path& file, std::uintmax_t max_bytes) {
  return open_input_file(file, max_bytes).bytes;
}

InputFile open_input_file(const fs::path& file, std::uintmax_t max_bytes) {
  if (const std::string problem = problem_of_file(file); !problem.empty()) fail(file, problem);
  // Opening a pipe does not wait for its writer.
  const Descriptor opened(open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  struct stat status {};
  if (opened.get() < 0 || fstat(opened.get(), &status) != 0)
    fail(file, "cannot be opened: " + std::generic_category().message(errno));
  // The bytes from a pipe are counted while they are read
  const bool is_regular = S_ISREG(status.st_mode);
  if (is_regular && static_cast<std::uintmax_t>(status.st_size) > max_bytes)
    fail_as_too_large(file, max_bytes);

  InputFile read{
      .bytes = {},
      .status = fs::file_status(is_regular ? fs::file_type::regular : fs::file_type::fifo,
                                static_cast<fs::perms>(status.st_mode) & fs::perms::mask)};
  if (is_regular) read.bytes.reserve(static_cast<std::size_t>(status.st_size));
  std::array<char, kChunk_bytes> chunk;  // not zeroed: most files are small
  for (bool more = true; more;) {
    if (!is_regular) await_pipe(opened.get(), file);
    const ssize_t count = ::read(opened.get(), chunk.data(), chunk.size());
    if (count < 0 && errno != EINTR && errno != EAGAIN) fail(file, "cannot be read to its end");
    if (count > 0) read.bytes.append(chunk.data(), static_cast<std::size_t>(count));
    if (read.bytes.size() > max_bytes) fail_as_too_large(file, max_bytes);
    more = count != 0;
  }
  if (read.bytes.starts_with("\xFF\xFE") || read.bytes.starts_with("\xFE\xFF"))
    fail(file, "a text in UTF-16: save it as UTF-8 (iconv -f UTF-16 -t UTF-8)");
  return read;
}

}  // namespace km
