#include "modules/sensors/label_file.hpp"

#include <array>
#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <utility>

#include "modules/sensors/decoded_image.hpp"

namespace km {
namespace {

// Ids of an image of BGR or BGRA pixels. Labels come in runs: one lookup for each.
void map_colors(const cv::Mat& image, const LabelPalette& palette, LabelResult& result) {
  const int channels = image.channels();
  std::optional<std::array<std::uint8_t, 3>> last;
  std::optional<LabelId> id;
  for (int y = 0; y < image.rows; ++y) {
    const std::uint8_t* bgr = image.ptr(y);
    for (int x = 0; x < image.cols; ++x, bgr += channels) {
      const std::array<std::uint8_t, 3> color = {bgr[2], bgr[1], bgr[0]};
      if (color != last) id = palette.id_of(color);
      last = color;
      result.image.ids.push_back(id.value_or(0));
      result.unknown_pixels += id ? 0 : 1;
    }
  }
}

}  // namespace

LabelResult load_label_image(const std::filesystem::path& file, int width, int height,
                             const LabelPalette& palette) {
  LoadedImage<cv::Mat> loaded = decode_image(file, cv::IMREAD_UNCHANGED, {width, height});
  if (loaded.status != ImageStatus::kOk) return {failure_of<LabelImage>(std::move(loaded)), 0};
  const cv::Mat& decoded = loaded.image;
  LabelResult result;
  result.image = {width, height, {}};
  if (decoded.type() == CV_8UC1) {
    result.image.ids.assign(decoded.begin<std::uint8_t>(), decoded.end<std::uint8_t>());
    return result;
  }
  const bool is_color = decoded.type() == CV_8UC3 || decoded.type() == CV_8UC4;
  const std::string problem = !is_color ? "labels are 8-bit ids or 8-bit colours"
                              : palette.classes().empty()
                                  ? "labels as colours, but no label_palette.csv to map them"
                                  : "";
  if (!problem.empty()) return {{ImageStatus::kWrongFormat, file.string() + ": " + problem, {}}, 0};
  result.image.ids.reserve(decoded.total());
  map_colors(decoded, palette, result);
  return result;
}

}  // namespace km
