#include "modules/recordings/random_access_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>

#include "modules/core/input_file.hpp"

namespace km {

RandomAccessFile::RandomAccessFile(const std::filesystem::path& path) : path_(path) {
  if (const std::string problem = problem_of_file(path); !problem.empty())
    throw InputFileError(path.string() + ": " + problem);
  descriptor_ = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (descriptor_ < 0)
    throw InputFileError(path.string() +
                         ": cannot be opened: " + std::generic_category().message(errno));
  struct stat status {};
  if (fstat(descriptor_, &status) != 0 || !S_ISREG(status.st_mode)) {
    close(descriptor_);
    throw InputFileError(path.string() + ": not a regular file");
  }
  size_ = static_cast<std::uint64_t>(status.st_size);
}

RandomAccessFile::~RandomAccessFile() {
  close(descriptor_);
}

std::vector<std::uint8_t> RandomAccessFile::read(std::uint64_t offset, std::uint64_t size) const {
  const auto fail = [&] { throw InputFileError(place(offset) + ": cannot be read"); };
  if (!has(offset, size)) fail();
  std::vector<std::uint8_t> bytes(size);
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t count = pread(descriptor_, bytes.data() + done, bytes.size() - done,
                                static_cast<off_t>(offset + done));
    if (count == 0 || (count < 0 && errno != EINTR)) fail();
    if (count > 0) done += static_cast<std::size_t>(count);
  }
  return bytes;
}

std::string RandomAccessFile::beginning(std::uint64_t size) const {
  const auto bytes = read(0, std::min(size_, size));
  return {bytes.begin(), bytes.end()};
}

std::string RandomAccessFile::place(std::uint64_t offset) const {
  return path_.string() + " byte " + std::to_string(offset);
}

}  // namespace km
