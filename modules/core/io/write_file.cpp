#include "modules/core/io/write_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

namespace km {
namespace {

namespace fs = std::filesystem;

std::system_error cannot_write(const fs::path& file, int error) {
  return {error, std::generic_category(), file.string() + ": cannot be written"};
}

// Number of bytes written, and the error that ended writing, or 0.
struct Written {
  std::size_t bytes = 0;
  int error = 0;
};

Written write_to(const fs::path& file, int how, std::string_view bytes,
                 const WriteOptions& options) {
  const int descriptor = open(file.c_str(), how | O_WRONLY | O_CREAT | O_CLOEXEC, options.mode);
  if (descriptor < 0) return {0, errno};
  Written written;
  while (written.bytes < bytes.size() && written.error == 0) {
    const ssize_t n =
        ::write(descriptor, bytes.data() + written.bytes, bytes.size() - written.bytes);
    if (n > 0)
      written.bytes += static_cast<std::size_t>(n);
    else if (n == 0 || errno != EINTR)
      written.error = n == 0 ? ENOSPC : errno;
  }
  if (options.durable && written.error == 0 && fdatasync(descriptor) != 0) written.error = errno;
  if (close(descriptor) != 0 && written.error == 0) written.error = errno;
  return written;
}

}  // namespace

void write_file(const fs::path& file, std::string_view bytes, const WriteOptions& options) {
  std::error_code unknown;
  const fs::file_status there = fs::symlink_status(file, unknown);
  if (options.through_links && fs::exists(there) && !fs::is_regular_file(there)) {
    if (const int error = write_to(file, O_TRUNC, bytes, options).error)
      throw cannot_write(file, error);
    return;
  }
  fs::path partial = file;
  partial += ".part";
  // A remaining partial file may have another mode, or be a link to any file.
  if (!options.through_links || fs::is_symlink(fs::symlink_status(partial, unknown)))
    unlink(partial.c_str());
  const int how = options.through_links ? O_TRUNC | O_NOFOLLOW : O_EXCL;
  int error = write_to(partial, how, bytes, options).error;
  if (error == 0 && std::rename(partial.c_str(), file.c_str()) != 0) error = errno;
  if (error == 0) return;
  unlink(partial.c_str());
  throw cannot_write(file, error);
}

void append_to_file(const fs::path& file, std::string& waiting, const WriteOptions& options) {
  const Written written = write_to(file, O_APPEND, waiting, options);
  waiting.erase(0, written.bytes);
  if (written.error != 0) throw cannot_write(file, written.error);
}

}  // namespace km
