#include "apps/robot/reserved_room.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <utility>

#include "runtime/log.hpp"

namespace km {
namespace {

// Allocates the bytes of a file from its present end up to `bytes`. Returns an error, or 0.
int allocate(const std::filesystem::path& file, std::uint64_t from, std::uint64_t bytes) {
  const int descriptor = open(file.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0666);
  if (descriptor < 0) return errno;
  const int error =
      posix_fallocate(descriptor, static_cast<off_t>(from), static_cast<off_t>(bytes - from));
  if (error != 0) (void)!ftruncate(descriptor, static_cast<off_t>(from));
  close(descriptor);
  return error;
}

}  // namespace

ReservedRoom::ReservedRoom(std::filesystem::path file) : file_(std::move(file)) {
  release();
}

void ReservedRoom::reserve(std::uint64_t bytes) {
  if (bytes <= reserved_bytes_) return;
  // A step of this size makes the calls rare.
  constexpr std::uint64_t kStep_bytes = std::uint64_t{16} << 10U;
  bytes = (bytes / kStep_bytes + 1) * kStep_bytes;
  if (const int error = allocate(file_, reserved_bytes_, bytes))
    log::limited(log::Level::kWarn, "results", file_.string())
        << file_.string() << ": no room for " << bytes
        << " bytes of results at the end of the run: " << std::generic_category().message(error);
  else
    reserved_bytes_ = bytes;
}

void ReservedRoom::release() noexcept {
  unlink(file_.c_str());
  reserved_bytes_ = 0;
}

}  // namespace km
