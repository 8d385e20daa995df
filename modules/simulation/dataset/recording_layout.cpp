#include "modules/simulation/dataset/recording_layout.hpp"

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

}  // namespace km
