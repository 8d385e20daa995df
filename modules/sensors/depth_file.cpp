#include "modules/sensors/depth_file.hpp"

#include <opencv2/imgcodecs.hpp>
#include <utility>

#include "modules/sensors/decoded_image.hpp"

namespace km {
namespace {

constexpr std::uint16_t kNoMeasurement = 65535;
constexpr double kMaxStored_mm = 65535.0;

}  // namespace

DepthResult load_depth_image(const std::filesystem::path& file, int width, int height,
                             double scale_m, const DepthRange& range) {
  LoadedImage<cv::Mat> loaded = decode_image(file, cv::IMREAD_UNCHANGED, {width, height});
  if (loaded.status != ImageStatus::kOk) return failure_of<DepthImage>(std::move(loaded));
  const cv::Mat& decoded = loaded.image;
  if (decoded.type() != CV_16UC1)
    return {ImageStatus::kWrongFormat,
            file.string() + ": " + std::to_string(8 * decoded.elemSize1()) + " bits and " +
                std::to_string(decoded.channels()) +
                " channels, depth is an image of 16 bits and one channel",
            {}};
  DepthResult result;
  result.image = {width, height, {decoded.begin<std::uint16_t>(), decoded.end<std::uint16_t>()}};
  const double scale_mm = 1e3 * scale_m, min_mm = 1e3 * range.min_m;
  const double max_mm = std::min(1e3 * range.max_m, kMaxStored_mm);
  for (std::uint16_t& value : result.image.millimetres) {
    const double depth_mm = scale_mm * value;
    const bool measured =
        value != 0 && value != kNoMeasurement && depth_mm >= min_mm && depth_mm <= max_mm;
    value = measured ? static_cast<std::uint16_t>(depth_mm + 0.5) : std::uint16_t{0};
  }
  return result;
}

}  // namespace km
