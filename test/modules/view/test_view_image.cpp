#include "modules/view/view_content.hpp"
#include "test/support/image_file.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

TrackedImage image_of(int width, int height) {
  StereoFrame frame;
  frame.stamp = 77;
  frame.left.width = width;
  frame.left.height = height;
  frame.left.pixels.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  return {std::make_shared<const StereoFrame>(std::move(frame)), {}};
}

Camera camera_of(int width, int height) {
  Camera camera;
  camera.width = width;
  camera.height = height;
  camera.fx = camera.fy = 400.0;
  camera.cx = 0.5 * (width - 1);
  camera.cy = 0.5 * (height - 1);
  return camera;
}

cv::Mat shown(const ViewImage& image) {
  return decoded(image.jpeg, DecodedPixels::kStored);
}

TEST_CASE("Images keep their size or are reduced to the maximum width") {
  const ViewImage as_it_is = view_image(image_of(640, 480), camera_of(640, 480));
  CHECK(as_it_is.stamp == 77);
  CHECK(shown(as_it_is).cols == 640);
  CHECK(shown(as_it_is).rows == 480);
  const ViewImage smaller = view_image(image_of(1280, 800), camera_of(1280, 800));
  CHECK(shown(smaller).cols == 640);
  CHECK(shown(smaller).rows == 400);
  CHECK(shown(smaller).channels() == 1);
  CHECK_THROWS_AS(view_image(image_of(0, 0), Camera{}), std::invalid_argument);
}

// The feature must lie at the centre of a bright square that is drawn around it.
TEST_CASE("Features are where the image shows them") {
  TrackedImage image = image_of(1280, 800);
  StereoFrame frame = *image.frame;
  const int u = 1000, v = 202;
  for (int y = v - 20; y <= v + 20; ++y)
    for (int x = u - 20; x <= u + 20; ++x)
      frame.left.pixels[static_cast<std::size_t>(y * 1280 + x)] = 255;
  const Camera camera = camera_of(1280, 800);
  image = {std::make_shared<const StereoFrame>(std::move(frame)),
           {{(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy}}};
  const ViewImage sent = view_image(image, camera);
  REQUIRE(sent.features.size() == 1);
  const cv::Mat pixels = shown(sent);
  double sum = 0.0, sum_x = 0.0, sum_y = 0.0;
  for (int y = 0; y < pixels.rows; ++y)
    for (int x = 0; x < pixels.cols; ++x) {
      const double value = pixels.at<std::uint8_t>(y, x);
      sum += value;
      sum_x += value * x;
      sum_y += value * y;
    }
  CHECK(static_cast<double>(sent.features[0][0]) == Approx(sum_x / sum).margin(0.2));
  CHECK(static_cast<double>(sent.features[0][1]) == Approx(sum_y / sum).margin(0.2));
}

TEST_CASE("A noisy image fits into an update") {
  TrackedImage image = image_of(640, 640);
  StereoFrame frame = *image.frame;
  std::mt19937 rng(1);
  for (std::uint8_t& pixel : frame.left.pixels) pixel = static_cast<std::uint8_t>(rng());
  image.frame = std::make_shared<const StereoFrame>(std::move(frame));
  image.bearings.resize(5000, Eigen::Vector2d::Zero());
  CHECK_NOTHROW(encode_view(view_image(image, camera_of(640, 640))));
}

constexpr std::int8_t kUnknownCell = OccupancyGrid::kUnknown, kFreeCell = OccupancyGrid::kFree,
                      kOccupiedCell = OccupancyGrid::kOccupied;

using Values = std::vector<std::uint8_t>;

// Brute force: a cell of the reduced map is occupied if any of its cells is, else free if any is.
TEST_CASE("A large 2D map is reduced until it fits, and no obstacle is lost") {
  std::mt19937 rng(5);
  OccupancyGrid map{0.05, {0.0, 0.0}, 601, 333, {}};
  for (int k = 0; k < map.width * map.height; ++k) {
    const auto draw = std::uniform_int_distribution<int>(0, 99)(rng);
    map.cells.push_back(draw == 0 ? kOccupiedCell : draw < 20 ? kFreeCell : kUnknownCell);
  }
  const auto raster = view_raster(map);
  REQUIRE(raster);
  CHECK(is_valid(*raster));
  CHECK(decode_view(encode_view(*raster)));
  const int factor = static_cast<int>(std::lround(raster->resolution_m / 0.05F));
  CHECK(factor > 1);
  CHECK(static_cast<int>(raster->width) == (map.width + factor - 1) / factor);
  Values expected(std::size_t{raster->width} * raster->height, ViewRaster::kUnknown);
  for (int y = 0; y < map.height; ++y)
    for (int x = 0; x < map.width; ++x) {
      auto& value = expected[static_cast<std::size_t>(x / factor) +
                             raster->width * static_cast<std::size_t>(y / factor)];
      const std::int8_t cell = map.cells[map.index(x, y)];
      if (cell == kOccupiedCell) value = ViewRaster::kOccupied;
      if (cell == kFreeCell && value != ViewRaster::kOccupied) value = ViewRaster::kFree;
    }
  CHECK(cells_of(*raster) == expected);
}

TEST_CASE("The largest objects are sent if not all fit, and the others are counted") {
  constexpr std::size_t kObjects = 3000;
  ObjectList list{.anchor = 2, .objects = {}};
  for (std::size_t k = 1; k <= kObjects; ++k) {
    MapObject object{.label = 5, .box = {}, .robots = {1, 40000}};
    object.box.size_m = Eigen::Vector3d::Constant(0.001 * static_cast<double>(k));
    list.objects.push_back(object);
  }
  const ViewObjects view = view_objects(list);
  CHECK(view.anchor == 2);
  CHECK(view.objects.size() > 1000);
  CHECK(view.objects.size() + view.left_out == kObjects);
  CHECK(view.objects.front().size_m.x() == Approx(0.001 * kObjects));
  CHECK(view.objects.back().size_m.x() == Approx(0.001 * (view.left_out + 1.0)));
  CHECK(decode_view(encode_view(view)));
}

}  // namespace
}  // namespace km
