#include "modules/view/view_content.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <utility>

#include "modules/images/image_codec.hpp"
#include "modules/images/image_view.hpp"

namespace km {
namespace {

// The rest of an update is room for the features and the head.
constexpr std::size_t kMaxJpegBytes = kMaxViewBytes - 20000;
constexpr std::size_t kMaxFeatures = 2000;

std::vector<std::uint8_t> jpeg_of(const cv::Mat& image) {
  for (const int quality : {60, 30, 10})
    if (auto jpeg = encode_jpeg(image, quality); jpeg.size() <= kMaxJpegBytes) return jpeg;
  return {};  // Even the smallest quality is too large, as for noise in a tall and narrow image.
}

constexpr std::size_t kObjectsHead_bytes = 16;

// Upper bound on the bytes of an object in an update.
std::size_t bytes_of(const MapObject& object) {
  constexpr std::size_t kFixed = 1 + 7 * sizeof(float) + 3, kRobot = 3;
  return kFixed + kRobot * object.robots.size();
}

constexpr std::size_t kRasterHead_bytes = 64;
constexpr std::size_t kLongest_run = 255;

// Cells of a raster that may still be too large.
struct Cells {
  std::size_t width, height;
  std::vector<std::uint8_t> values;
};

Cells halved(const Cells& cells) {
  Cells half{(cells.width + 1) / 2, (cells.height + 1) / 2, {}};
  half.values.assign(half.width * half.height, ViewRaster::kUnknown);
  for (std::size_t y = 0; y < cells.height; ++y)
    for (std::size_t x = 0; x < cells.width; ++x) {
      std::uint8_t& value = half.values[x / 2 + half.width * (y / 2)];
      value = std::min(value, cells.values[x + cells.width * y]);
    }
  return half;
}

std::vector<std::uint8_t> runs_of(const std::vector<std::uint8_t>& values) {
  std::vector<std::uint8_t> runs;
  for (std::size_t begin = 0, end = 0; begin < values.size(); begin = end) {
    while (end < values.size() && end - begin < kLongest_run && values[end] == values[begin]) ++end;
    runs.push_back(static_cast<std::uint8_t>(end - begin));
    runs.push_back(values[begin]);
  }
  return runs;
}

// Halves the cells until the raster fits.
ViewRaster fitted(ViewRaster raster, Cells cells) {
  while (true) {
    raster.width = static_cast<std::uint32_t>(cells.width);
    raster.height = static_cast<std::uint32_t>(cells.height);
    if (std::max(cells.width, cells.height) <= ViewRaster::kMaxSide &&
        cells.values.size() <= ViewRaster::kMaxCells) {
      raster.runs = runs_of(cells.values);
      if (raster.runs.size() + kRasterHead_bytes <= kMaxViewBytes) return raster;
    }
    cells = halved(cells);
    raster.resolution_m *= 2.0F;
  }
}

}  // namespace

ViewImage view_image(const TrackedImage& image, const Camera& camera) {
  const GrayImage& left = image.frame->left;
  if (left.width <= 0 || left.height <= 0)
    throw std::invalid_argument("view: an image without pixels");
  const double scale = std::min(1.0, static_cast<double>(kMaxViewWidth) / left.width);
  cv::Mat small = view(left);
  if (scale < 1.0) cv::resize(small, small, {}, scale, scale, cv::INTER_AREA);
  ViewImage result{image.frame->stamp, jpeg_of(small), {}};
  for (const Eigen::Vector2d& bearing : image.bearings) {
    const auto pixel = camera.project(bearing);
    if (!pixel || !pixel->allFinite() || result.features.size() == kMaxFeatures) continue;
    // Integer pixel coordinates are pixel centres.
    const Eigen::Vector2f there = (scale * (pixel->array() + 0.5) - 0.5).matrix().cast<float>();
    result.features.push_back({there.x(), there.y()});
  }
  return result;
}

ViewObjects view_objects(const ObjectList& list) {
  std::vector<const MapObject*> all;
  for (const MapObject& object : list.objects) all.push_back(&object);
  std::ranges::stable_sort(all, std::greater{},
                           [](const MapObject* object) { return object->box.volume_m3(); });
  ViewObjects view{.anchor = list.anchor};
  std::size_t bytes = kObjectsHead_bytes;
  for (const MapObject* const object : all) {
    bytes += bytes_of(*object);
    if (bytes > kMaxViewBytes) break;
    const ObjectBox& box = object->box;
    view.objects.push_back({object->label, box.center.cast<float>(),
                            static_cast<float>(box.yaw_rad), box.size_m.cast<float>(),
                            object->robots});
  }
  view.left_out = static_cast<std::uint32_t>(all.size() - view.objects.size());
  return view;
}

std::optional<ViewRaster> view_raster(const OccupancyGrid& map) {
  if (map.empty()) return std::nullopt;
  Cells cells{static_cast<std::size_t>(map.width), static_cast<std::size_t>(map.height), {}};
  for (const std::int8_t cell : map.cells)
    cells.values.push_back(cell == OccupancyGrid::kUnknown ? ViewRaster::kUnknown
                           : cell == OccupancyGrid::kFree  ? ViewRaster::kFree
                                                           : ViewRaster::kOccupied);
  const Eigen::Vector2f corner = map.origin.cast<float>();
  return fitted({.anchor = map.anchor,
                 .resolution_m = static_cast<float>(map.resolution_m),
                 .origin = {corner.x(), corner.y(), static_cast<float>(map.z_m)}},
                std::move(cells));
}

}  // namespace km
