#include "modules/sensors/image_file.hpp"

#include <opencv2/imgcodecs.hpp>
#include <utility>

#include "modules/sensors/decoded_image.hpp"

namespace km {

ReaderFault fault_of(ImageStatus status) {
  switch (status) {
    case ImageStatus::kMissing:
      return ReaderFault::kMissingImage;
    case ImageStatus::kWrongSize:
      return ReaderFault::kWrongImageSize;
    case ImageStatus::kWrongFormat:
      return ReaderFault::kWrongImageFormat;
    default:
      return ReaderFault::kUnreadableImage;
  }
}

ImageResult load_gray_image(const std::filesystem::path& file, int width, int height) {
  LoadedImage<cv::Mat> loaded = decode_image(file, cv::IMREAD_GRAYSCALE, {width, height});
  if (loaded.status != ImageStatus::kOk) return failure_of<GrayImage>(std::move(loaded));
  const cv::Mat& decoded = loaded.image;
  return {ImageStatus::kOk, {}, {width, height, {decoded.datastart, decoded.dataend}}};
}

}  // namespace km
