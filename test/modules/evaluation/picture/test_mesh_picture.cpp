#include <algorithm>
#include <catch2/catch.hpp>

#include "modules/evaluation/picture/mesh_picture.hpp"
#include "modules/evaluation/picture/picture_legend.hpp"
#include "test/modules/evaluation/mesh/shapes.hpp"

namespace km {
namespace {

const LabelPalette kPalette({{1, "road", {200, 0, 0}}, {2, "grass", {0, 200, 0}}});

cv::Mat3b draw(const std::vector<LabelledMesh>& meshes, PictureColor color,
               std::vector<PictureLine> lines = {}) {
  PictureScene scene;
  scene.meshes = meshes;
  scene.palette = kPalette;
  scene.lines = std::move(lines);
  PictureOptions options;
  options.color = color;
  const Eigen::AlignedBox3d box(Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(4, 4, 1));
  return draw_meshes(scene, parse_view("top", box, 200, 200), options);
}

// Which of red, green, blue is strongest; -1 for grey.
int hue(const cv::Vec3b& bgr) {
  const int blue = bgr[0], green = bgr[1], red = bgr[2];
  if (red > green + 40 && red > blue + 40) return 0;
  if (green > red + 40 && green > blue + 40) return 1;
  return blue > red + 40 && blue > green + 40 ? 2 : -1;
}

const std::vector<LabelledMesh> kHalves = {rectangle({0, 0, 0}, {2, 0, 0}, {0, 4, 0}, 4, 1),
                                           rectangle({2, 0, 0}, {2, 0, 0}, {0, 4, 0}, 4, 2)};

}  // namespace

TEST_CASE("Surfaces have the colours of their labels", "[mesh_picture]") {
  const cv::Mat3b picture = draw(kHalves, PictureColor::kLabel);
  CHECK(picture.cols == 200);
  CHECK(picture.rows > 200);  // the legend
  CHECK(hue(picture(100, 50)) == 0);
  CHECK(hue(picture(100, 150)) == 1);
  CHECK(picture(100, 1) == cv::Vec3b(255, 255, 255));
}

TEST_CASE("Other colours: none, the vertices' own, one per mesh", "[mesh_picture]") {
  CHECK(hue(draw(kHalves, PictureColor::kShade)(100, 50)) == -1);
  auto own = kHalves;
  for (auto& mesh : own) mesh.colors.assign(mesh.vertices.size(), {0, 0, 230});
  CHECK(hue(draw(own, PictureColor::kOwn)(100, 50)) == 2);
  const cv::Mat3b robots = draw(kHalves, PictureColor::kRobot);
  CHECK(hue(robots(100, 50)) != hue(robots(100, 150)));
}

TEST_CASE("Unknown labels are grey", "[mesh_picture]") {
  const std::vector<LabelledMesh> meshes = {square(4.0F, 0.0F, 4, 0)};
  const cv::Vec3b pixel = draw(meshes, PictureColor::kLabel)(100, 100);
  CHECK(hue(pixel) == -1);
  CHECK(pixel[0] > 60);
}

TEST_CASE("Corners are darker than open ground, and steps have lines", "[mesh_picture]") {
  std::vector<LabelledMesh> meshes = {square(4.0F, 0.0F)};
  const auto green = [](const cv::Vec3b& pixel) { return static_cast<int>(pixel[1]); };
  const int open = green(draw(meshes, PictureColor::kShade)(100, 100));
  CHECK(open > 150);
  meshes.push_back(rectangle({2.5F, 0, 1}, {1.5F, 0, 0}, {0, 4, 0}, 1));  // a roof 1 m up
  const cv::Mat3b picture = draw(meshes, PictureColor::kShade);
  const int edge = 100 + static_cast<int>(0.5 / 4.0 / 1.04 * 200);
  CHECK(green(picture(100, edge - 2)) < open - 20);
  int darkest = 255;
  for (int column = edge - 3; column <= edge + 3; ++column)
    darkest = std::min(darkest, green(picture(100, column)));
  CHECK(darkest < open / 2 + 20);
}

TEST_CASE("Trajectories are drawn on top, from a ring to a disc", "[mesh_picture]") {
  const std::vector<LabelledMesh> meshes = {square(4.0F, 0.0F, 4, 2)};
  const PictureLine line = {"robot0", {{1, 2, -5}, {3, 2, -5}}};  // below the surface
  const cv::Mat3b picture = draw(meshes, PictureColor::kLabel, {line});
  const auto column = [](double x) { return 100 + static_cast<int>((x - 2.0) * 200 / 4.16); };
  CHECK(hue(picture(100, column(2.0))) == 0);
  CHECK(picture(100, column(1.0)) == cv::Vec3b(255, 255, 255));
  CHECK(hue(picture(100, column(3.0))) == 0);
  CHECK(hue(picture(90, column(2.0))) == 1);
}

TEST_CASE("The scale bar has the length it names", "[mesh_picture]") {
  PictureView view;
  view.width = 400;
  view.height = 100;
  view.scale = 30.0;  // a fifth of the width is 2.7 m: the bar is 2 m, 60 px
  const cv::Mat3b strip = draw_legend({}, view);
  REQUIRE(strip.cols == 400);
  int longest = 0;
  for (int row = 0; row < strip.rows; ++row) {
    int dark = 0;
    for (int column = 0; column < 80; ++column) dark += strip(row, column)[1] < 128 ? 1 : 0;
    longest = std::max(longest, dark);
  }
  CHECK(std::abs(longest - 60) <= 3);
  view.perspective = true;
  CHECK(draw_legend({}, view).rows == 0);
}

TEST_CASE("A legend takes as many rows as it needs", "[mesh_picture]") {
  PictureView view;
  view.width = 300;
  view.perspective = true;
  const std::vector<LegendEntry> few(2, {"building", {1, 2, 3}, false});
  const std::vector<LegendEntry> many(12, {"building", {1, 2, 3}, true});
  CHECK(draw_legend(few, view).cols == 300);
  CHECK(draw_legend(many, view).rows > 2 * draw_legend(few, view).rows);
}

TEST_CASE("Pictures of nothing, and colours there are not, are refused", "[mesh_picture]") {
  CHECK_THROWS_WITH(draw({}, PictureColor::kShade), "no mesh to draw has a face");
  CHECK_THROWS_WITH(draw(kHalves, PictureColor::kOwn), "mesh 0: its vertices have no colours");
  auto bare = kHalves;
  bare[1].labels.clear();
  CHECK_THROWS_WITH(draw(bare, PictureColor::kLabel), "mesh 1: its vertices have no labels");
}

}  // namespace km
