#include "apps/robot/final_room.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <utility>

#include "apps/result_files.hpp"
#include "modules/core/io/descriptor.hpp"
#include "runtime/log.hpp"

namespace km {
namespace {

// Allocates the bytes of a file from its present end up to `bytes`. Returns an error, or 0.
int allocate(const std::filesystem::path& file, std::uint64_t from, std::uint64_t bytes) {
  const Descriptor opened(open(file.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0666));
  if (opened.get() < 0) return errno;
  const int error =
      posix_fallocate(opened.get(), static_cast<off_t>(from), static_cast<off_t>(bytes - from));
  if (error != 0) (void)!ftruncate(opened.get(), static_cast<off_t>(from));
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

FinalRoom::FinalRoom(const std::filesystem::path& output, std::size_t images)
    : trajectories_(output / kTrajectoryRoom), summary_(output / kSummaryRoom) {
  constexpr std::size_t kSummary_bytes = 32768;
  summary_.reserve(kSummary_bytes);
  grow(images, 0);
}

void FinalRoom::grow(std::size_t images, std::size_t keyframes) {
  // Rows of odometry.tum and optimized.tum, which has a row for each keyframe if there are no
  // images; and of optimized_keyframes.tum with its 36 numbers.
  constexpr std::size_t kImage_bytes = 240, kKeyframe_bytes = 700;
  trajectories_.reserve(kImage_bytes * images + kKeyframe_bytes * keyframes);
}

}  // namespace km
