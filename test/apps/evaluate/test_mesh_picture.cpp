#include "apps/evaluate/mesh_picture.hpp"
#include "apps/evaluate/picture_view.hpp"
#include "apps/evaluate/surface_image.hpp"
#include "test/modules/evaluation/mesh/shapes.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

const LabelPalette kPalette({{1, "road", {200, 0, 0}}, {2, "grass", {0, 200, 0}}});

cv::Mat3b draw(const std::vector<LabelledMesh>& meshes, PictureColor color,
               std::vector<PictureLine> lines = {}) {
  PictureScene scene{.meshes = meshes, .names = {}, .lines = std::move(lines), .palette = kPalette};
  const Eigen::AlignedBox3d box(Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(4, 4, 1));
  return draw_meshes(scene, parse_view("top", box, 200, 200), color);
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

TEST_CASE("Surfaces have the colours of their labels") {
  const cv::Mat3b picture = draw(kHalves, PictureColor::kLabel);
  CHECK(picture.cols == 200);
  CHECK(picture.rows > 200);  // the legend
  CHECK(hue(picture(100, 50)) == 0);
  CHECK(hue(picture(100, 150)) == 1);
  CHECK(picture(100, 1) == cv::Vec3b(255, 255, 255));
  const cv::Vec3b unknown = draw({square(4.0F, 0.0F, 4, 0)}, PictureColor::kLabel)(100, 100);
  CHECK(hue(unknown) == -1);
  CHECK(unknown[0] > 60);
}

TEST_CASE("Other colours are none, those of the vertices, and one per mesh") {
  CHECK(hue(draw(kHalves, PictureColor::kShade)(100, 50)) == -1);
  auto own = kHalves;
  for (auto& mesh : own) mesh.colors.assign(mesh.vertices.size(), {0, 0, 230});
  CHECK(hue(draw(own, PictureColor::kOwn)(100, 50)) == 2);
  const cv::Mat3b robots = draw(kHalves, PictureColor::kRobot);
  CHECK(hue(robots(100, 50)) != hue(robots(100, 150)));
}

TEST_CASE("Corners are darker than open ground and steps have lines") {
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

TEST_CASE("Trajectories are drawn on top from a ring to a disc") {
  const std::vector<LabelledMesh> meshes = {square(4.0F, 0.0F, 4, 2)};
  const PictureLine line = {"robot0", {{1, 2, -5}, {3, 2, -5}}};  // below the surface
  const cv::Mat3b picture = draw(meshes, PictureColor::kLabel, {line});
  const auto column = [](double x) { return 100 + static_cast<int>((x - 2.0) * 200 / 4.16); };
  CHECK(hue(picture(100, column(2.0))) == 0);
  CHECK(picture(100, column(1.0)) == cv::Vec3b(255, 255, 255));
  CHECK(hue(picture(100, column(3.0))) == 0);
  CHECK(hue(picture(90, column(2.0))) == 1);
}

TEST_CASE("The scale bar has the length it names, and the legend as many rows as necessary") {
  PictureView view{.width = 400, .height = 100};
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
  const std::vector<LegendEntry> many(12, {"building", {1, 2, 3}, true});
  CHECK(draw_legend(many, view).rows > 2 * strip.rows);
}

TEST_CASE("Pictures without faces and missing colours are refused") {
  CHECK_THROWS_WITH(draw({}, PictureColor::kShade), "no mesh to draw has a face");
  CHECK_THROWS_WITH(draw(kHalves, PictureColor::kOwn), "mesh 0: its vertices have no colours");
  auto bare = kHalves;
  bare[1].labels.clear();
  CHECK_THROWS_WITH(draw(bare, PictureColor::kLabel), "mesh 1: its vertices have no labels");
}

// 10 px per metre; the middle of the picture is the origin, its right x, its top y.
PictureView from_above() {
  PictureView view{.width = 100, .height = 80, .scale = 10.0};
  view.T_cam_world = make_pose(Eigen::Vector3d(1, -1, -1).asDiagonal(), {0, 0, 100});
  return view;
}

LabelledMesh triangle(float z) {
  LabelledMesh mesh;
  mesh.vertices = {{1, 1, z}, {4, 1, z}, {1, 3, z}};  // columns 60 to 90, rows 30 to 10
  mesh.faces = {{0, 1, 2}};
  return mesh;
}

TEST_CASE("Faces that are seen from behind are not drawn") {
  LabelledMesh ceiling = triangle(5.0F);
  std::swap(ceiling.faces[0][1], ceiling.faces[0][2]);  // visible from below
  LabelledMesh mesh = triangle(2.0F);
  mesh.append(ceiling);
  const SurfaceImage image = rasterise(mesh, from_above());
  CHECK(image.faces[image.at(65, 25)] == 0);
}

TEST_CASE("Perspective shows depth along z and clips surface behind the viewer") {
  PictureView view;
  view.width = view.height = 100;
  view.perspective = true;
  view.scale = 50.0;
  // A floor one metre below the viewer, from 10 m behind to 90 m ahead.
  const LabelledMesh floor = rectangle({-50, 1, -10}, {100, 0, 0}, {0, 0, 100}, 1);
  const SurfaceImage image = rasterise(floor, view);
  for (const int row : {55, 60, 75, 99}) {
    CAPTURE(row);
    const double expected_m = 50.0 / (row + 0.5 - 50.0);
    CHECK(image.depth_m[image.at(50, row)] == Approx(expected_m).epsilon(1e-4));
  }
  CHECK(image.faces[image.at(50, 45)] == SurfaceImage::kNone);
  CHECK(image.faces[image.at(50, 50)] == SurfaceImage::kNone);  // beyond 90 m
}

TEST_CASE("Neighbouring faces have no gap between them") {
  const LabelledMesh mesh = rectangle({-3.07F, -2.91F, 0}, {6.1F, 0, 0}, {0, 5.9F, 0}, 37);
  const SurfaceImage image = rasterise(mesh, from_above());
  for (int row = 12; row < 68; ++row)
    for (int column = 21; column < 79; ++column)
      REQUIRE(image.faces[image.at(column, row)] != SurfaceImage::kNone);
}

const Eigen::AlignedBox3d kBox(Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(10, 5, 2));

TEST_CASE("From above y is up and from the front z, and x is to the right") {
  const PictureView view = parse_view("top", kBox, 520, 400);
  CHECK(view.scale == Approx(50.0));  // 10 m and 4 % in 520 px
  CHECK(view.project({5, 2.5, 0}).head<2>().isApprox(Eigen::Vector2d(260, 200)));
  CHECK(view.project({6, 2.5, 0}).head<2>().isApprox(Eigen::Vector2d(310, 200)));
  CHECK(view.project({5, 3.5, 0}).head<2>().isApprox(Eigen::Vector2d(260, 150)));
  CHECK(view.project({5, 2.5, 0}).z() - view.project({5, 2.5, 1.5}).z() == Approx(1.5));
  const PictureView front = parse_view("front", kBox, 520, 400);
  CHECK(front.project({6, 0, 1}).isApprox(Eigen::Vector3d(310, 200, front.project({5, 0, 2}).z())));
  CHECK(front.project({5, 0, 2}).y() == Approx(150));
  CHECK(front.project({5, 4, 1}).z() - front.project({5, 1, 1}).z() == Approx(3.0));
}

TEST_CASE("A view from a position has the direction of yaw and pitch") {
  const PictureView view = parse_view("1,2,3,90,0", kBox, 200, 100);
  CHECK(view.project({1, 7, 3}).isApprox(Eigen::Vector3d(100, 50, 5)));
  CHECK(view.project({2, 7, 3}).x() > 100.0);  // looking along y, x is to the right
  CHECK(view.project({1, 7, 4}).y() < 50.0);
  const PictureView down = parse_view("1,2,3,0,-90", kBox, 200, 100);
  CHECK(down.project({1, 2, 0}).isApprox(Eigen::Vector3d(100, 50, 3)));
  CHECK(down.project({2, 2, 0}).y() < 50.0);  // ahead is up
  CHECK(down.project({1, 3, 0}).x() < 100.0);
}

TEST_CASE("Other views are refused with their text") {
  for (const char* text :
       {"", "up", "1,2,3", "1,2,3,4,x", "1,2,3,4,5,6", "1,,3,4,5", "nan,0,0,0,0"}) {
    CAPTURE(text);
    CHECK_THROWS_WITH(parse_view(text, kBox, 100, 100),
                      StartsWith("no view '" + std::string(text) + "'"));
  }
}

TEST_CASE("A few stray vertices do not affect the extent") {
  LabelledMesh mesh = square(10.0F, 0.0F, 99);  // 10,000 vertices
  mesh.vertices.emplace_back(500.0F, -300.0F, 80.0F);
  const Eigen::AlignedBox3d box = extent_of(mesh);
  CHECK(box.max().x() == Approx(10.0).margin(0.11));
  CHECK(box.min().y() == Approx(0.0).margin(0.11));
  CHECK(box.max().z() == 0.0);
  CHECK(extent_of(room()).isApprox(
      Eigen::AlignedBox3d(Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(4, 3, 2))));
  CHECK(extent_of({}).isEmpty());
}

}  // namespace
}  // namespace km
