#include "apps/lab/simulation/dataset/recording_files.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string>

namespace km {
namespace {

const char* folder_name(ImageChannel channel) {
  switch (channel) {
    case ImageChannel::kLeft:
      return "cam0";
    case ImageChannel::kRight:
      return "cam1";
    case ImageChannel::kDepth:
      return "depth0";
    case ImageChannel::kLabels:
      return "label0";
    case ImageChannel::kColor:
      break;
  }
  return "color0";
}

namespace fs = std::filesystem;

[[noreturn]] void fail(const fs::path& file, int error) {
  const char* const help = error == ENOSPC || error == EDQUOT
                               ? "; make room and run the same command again to continue"
                               : "";
  throw RecordingError(file.string() + ": cannot be written: " + std::strerror(error) + help);
}

// Returns 0, or the errno of the failure.
int write_all(int descriptor, std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return errno;
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
  return 0;
}

}  // namespace

std::filesystem::path RecordingLayout::folder(ImageChannel channel) const {
  return mav0_ / folder_name(channel);
}

std::filesystem::path RecordingLayout::image(ImageChannel channel, Stamp stamp) const {
  return folder(channel) / "data" / (std::to_string(stamp) + image_extension(channel));
}

std::filesystem::path RecordingLayout::list(ImageChannel channel) const {
  return folder(channel) / "data.csv";
}

std::filesystem::path RecordingLayout::calibration(ImageChannel channel) const {
  return folder(channel) / "sensor.yaml";
}

std::filesystem::path RecordingLayout::truth() const {
  return mav0_ / "state_groundtruth_estimate0" / "data.csv";
}

std::string RecordingLayout::image_extension(ImageChannel channel) const {
  const bool lossless = channel == ImageChannel::kDepth || channel == ImageChannel::kLabels;
  return extension(lossless ? ImageFormat::kPng : format_);
}

void write_whole_file(const fs::path& file, std::span<const std::uint8_t> bytes) {
  fs::path part = file;
  part += ".part";
  int descriptor = ::open(part.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (descriptor < 0 && errno == ENOENT) {
    std::error_code error;
    fs::create_directories(file.parent_path(), error);
    if (error) fail(file.parent_path(), error.value());
    descriptor = ::open(part.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  }
  if (descriptor < 0) fail(file, errno);
  int error = write_all(descriptor, bytes);
  if (::close(descriptor) != 0 && error == 0) error = errno;  // network disks report errors here
  if (error == 0 && ::rename(part.c_str(), file.c_str()) != 0) error = errno;
  if (error == 0) return;
  ::unlink(part.c_str());
  fail(file, error);
}

void write_whole_file(const fs::path& file, std::string_view text) {
  write_whole_file(file,
                   std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
}

bool is_whole_image(const fs::path& file) {
  constexpr std::array<std::uint8_t, 8> kPngEnd = {'I', 'E', 'N', 'D', 0xAE, 0x42, 0x60, 0x82};
  constexpr std::array<std::uint8_t, 2> kJpegEnd = {0xFF, 0xD9};
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return false;
  std::array<std::uint8_t, 8> tail{};
  const off_t size = ::lseek(descriptor, 0, SEEK_END);
  const bool read = size > 8 && ::pread(descriptor, tail.data(), tail.size(), size - 8) == 8;
  ::close(descriptor);
  if (!read) return false;
  return file.extension() == ".png"
             ? tail == kPngEnd
             : std::equal(kJpegEnd.begin(), kJpegEnd.end(), tail.end() - kJpegEnd.size());
}

}  // namespace km
