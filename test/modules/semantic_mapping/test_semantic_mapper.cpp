#include <opencv2/core/utility.hpp>

#include "modules/semantic_mapping/depth_view.hpp"
#include "test/modules/semantic_mapping/mesh_checks.hpp"
#include "test/modules/semantic_mapping/wall_scene.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

TEST_CASE("A room is mapped at its position with its labels") {
  const double voxel_m = GENERATE(0.05, 0.1);
  const Lens lens = GENERATE(
      Lens(), Lens(LensModel::kRadialTangential, {-0.28, 0.07, 2e-4, -1e-4}),  // as of EuRoC's
      Lens(LensModel::kEquidistant, {0.0034, 0.0007, -0.002, 0.0002}));        // as of TUM-VI's
  CAPTURE(voxel_m, to_string(lens.model()));
  Camera camera = small_camera();
  camera.lens = lens;
  SemanticMapper mapper(settings(voxel_m), camera, BoxRoom::palette());
  // Shifted and rotated against the grid.
  const SE3 T_odom_room = make_pose(
      Eigen::AngleAxisd(0.5, Eigen::Vector3d(0.1, 0.2, 1.0).normalized()).toRotationMatrix(),
      {20.3, -7.1, 0.4});
  for (int i = 0; i < 20; ++i)
    REQUIRE(integrate(mapper, render(camera, BoxRoom::T_room_cam(2 * i), cast_room),
                      T_odom_room * BoxRoom::T_room_cam(2 * i), static_cast<KeyframeIndex>(i)));
  mapper.update_mesh();
  const MapMesh map = mapper.mesh();
  REQUIRE(map.mesh.vertices.size() > 5000);
  REQUIRE(map.mesh.labels.size() == map.mesh.vertices.size());
  REQUIRE(map.seen_by.size() == map.mesh.vertices.size());
  double error_m = 0.0;
  std::size_t right = 0;
  for (std::size_t i = 0; i < map.mesh.vertices.size(); ++i) {
    const Eigen::Vector3d p = T_odom_room.inverse() * map.mesh.vertices[i].cast<double>();
    error_m += BoxRoom::distance(p);
    right += map.mesh.labels[i] == BoxRoom::label_at(p) ? 1 : 0;
    CHECK(map.seen_by[i][0] <= map.seen_by[i][1]);
  }
  const auto count = static_cast<double>(map.mesh.vertices.size());
  // Half a pixel at 5 m is 19 mm of a wall, and as much of depth if the wall is seen at 45 degrees.
  // Means over many frames are far below that.
  CHECK(error_m / count < 0.003);
  CHECK(static_cast<double>(right) / count > 0.97);  // wrong where walls meet
}

TEST_CASE("All pixels of a fisheye image with bearings are used") {
  Camera camera = small_camera();
  camera.fx = camera.fy = 40.0;  // the borders are more than 80 degrees off the axis
  camera.lens = Lens(LensModel::kEquidistant, {0.0, 0.0, 0.0, 0.0});
  DepthViewMaker maker(camera, 0.1, 10.0, {});
  DepthImage depth{camera.width, camera.height, {}};
  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width; ++u)
      depth.millimetres.push_back(static_cast<std::uint16_t>(1000 + u));
  const DepthView& view = maker.make(depth, nullptr);
  CHECK(view.width <= 2 * camera.width + 2);
  CHECK(std::ranges::count(view.pixels, 0U) == 1);      // the one for points outside
  for (const double x : {-1.5, -0.5, 0.0, 0.7, 1.9}) {  // tangents, up to 62 degrees
    const int u = static_cast<int>(std::lround(static_cast<double>(view.cx) + 40.0 * x));
    const int v = static_cast<int>(std::lround(static_cast<double>(view.cy)));
    const double source = camera.cx + 40.0 * std::atan((u - static_cast<double>(view.cx)) / 40.0);
    CAPTURE(x, u, v);
    CHECK(DepthView::depth_m(view.pixels[static_cast<std::size_t>(v * view.width + u)]) ==
          Approx(1.0 + 1e-3 * std::round(source)).margin(1.1e-3));
  }
}

TEST_CASE("Two depths are averaged by their weights") {
  // The depth is 2.00 m from z = 0, and 4.04 m from z = -2 m: surface at 2.00 and 2.04 m.
  SemanticMappingConfig config = settings();
  config.depth_sigma_per_m = 0.005;
  SemanticMapper mapper(config, small_camera());
  // Both images show the same square of surface, because the filter averages over steps.
  const auto flat = [](double depth) {
    const Camera camera = small_camera();
    DepthImage image = wall(depth).depth;
    for (int v = 0; v < camera.height; ++v)
      for (int u = 0; u < camera.width; ++u)
        if (std::max(std::abs(u - camera.cx), std::abs(v - camera.cy)) * depth > 0.5 * camera.fx)
          image.millimetres[static_cast<std::size_t>(v * camera.width + u)] = 0;
    return image;
  };
  (void)mapper.integrate(flat(2.00), nullptr, at(0, 0, 0), 0);
  (void)mapper.integrate(flat(4.04), nullptr, at(0, 0, -2), 0);
  mapper.update_mesh();
  // Variances: 1e-4 + (0.005 z^2)^2.
  const double near = 1.0 / (1e-4 + std::pow(0.005 * 4.0, 2));
  const double far = 1.0 / (1e-4 + std::pow(0.005 * 4.04 * 4.04, 2));
  const double expected_m = (near * 2.00 + far * 2.04) / (near + far);
  const MapMesh map = mapper.mesh();
  CHECK(map.mesh.labels.empty());
  std::size_t seen_twice = 0;
  for (const Eigen::Vector3f& p : map.mesh.vertices) {
    if (p.head<2>().cwiseAbs().maxCoeff() > 0.3F) continue;  // the border has one depth in places
    ++seen_twice;
    CHECK(static_cast<double>(p.z()) == Approx(expected_m).margin(7e-4));
  }
  CHECK(seen_twice > 30);
}

TEST_CASE("Pixels without depth change nothing") {
  SemanticMappingConfig config = settings();
  config.max_range_m = 65.0;
  SemanticMapper mapper(config, small_camera(), two_classes());
  DepthAndLabels images = wall(2.0);
  const std::uint16_t none = GENERATE(std::uint16_t{0}, std::uint16_t{65535}, std::uint16_t{100});
  CAPTURE(none);
  std::fill(images.depth.millimetres.begin(), images.depth.millimetres.end(), none);
  const IntegrationReport report = mapper.integrate(images.depth, &images.labels, at(0), 0);
  CHECK(report.status == IntegrationStatus::kIntegrated);
  mapper.update_mesh();
  CHECK(mapper.mesh().mesh.empty());
  CHECK(mapper.size().blocks == 0);

  // One half of an image has depth, and only that half is mapped.
  images = wall(2.0);
  for (std::size_t i = 0; i < images.depth.millimetres.size() / 2; ++i)
    images.depth.millimetres[i] = none;
  REQUIRE(integrate(mapper, images, at(0), 0));
  mapper.update_mesh();
  const MapMesh map = mapper.mesh();
  CHECK(map.mesh.vertices.size() > 100);
  for (const Eigen::Vector3f& p : map.mesh.vertices) {
    CHECK(p.y() > -0.11F);  // a voxel beyond the middle
    CHECK(p.z() == Approx(2.0F).margin(1e-3));
  }
}

TEST_CASE("Unusable frames are refused and leave the map unchanged") {
  SemanticMapper mapper(settings(), small_camera(), two_classes());
  const DepthAndLabels good = wall(2.0);
  REQUIRE(integrate(mapper, good, at(0), 3));
  mapper.update_mesh();
  const MapMesh before = mapper.mesh();
  const std::size_t blocks = mapper.size().blocks;

  SECTION("a depth image of another size") {
    DepthImage depth = good.depth;
    depth.width = 80;
    CHECK(mapper.integrate(depth, nullptr, at(0), 3).status ==
          IntegrationStatus::kDepthSizeDiffers);
    depth = good.depth;
    depth.millimetres.pop_back();
    CHECK(mapper.integrate(depth, nullptr, at(0), 3).status ==
          IntegrationStatus::kDepthSizeDiffers);
  }
  SECTION("a pose that is not finite or not rigid") {
    SE3 T = at(0);
    T.translation().x() = std::numeric_limits<double>::quiet_NaN();
    CHECK(mapper.integrate(good.depth, nullptr, T, 3).status == IntegrationStatus::kPoseUnusable);
    T = at(0);
    T.linear() *= 1.1;
    CHECK(mapper.integrate(good.depth, nullptr, T, 3).status == IntegrationStatus::kPoseUnusable);
    T = at(0);
    T.linear().col(0) *= -1.0;
    CHECK(mapper.integrate(good.depth, nullptr, T, 3).status == IntegrationStatus::kPoseUnusable);
  }
  SECTION("a keyframe before the last") {
    CHECK_THROWS_AS(mapper.integrate(good.depth, nullptr, at(0), 2), std::invalid_argument);
  }
  CHECK(mapper.update_mesh() == 0);
  CHECK(mapper.mesh().mesh.vertices == before.mesh.vertices);
  CHECK(mapper.size().blocks == blocks);
}

TEST_CASE("A pose outside the map's reach maps nothing") {
  SemanticMapper mapper(settings(), small_camera(), two_classes());
  const double far_m = GENERATE(1e7, -1e12, 1e300);
  CAPTURE(far_m);
  const IntegrationReport report = mapper.integrate(wall(2.0).depth, nullptr, at(far_m), 0);
  CHECK(report.blocks_refused > 0);
  CHECK(mapper.size().blocks == 0);
}

TEST_CASE("Labels of another size or outside the palette are dropped and counted") {
  SemanticMapper mapper(settings(), small_camera(), two_classes());
  DepthAndLabels images = wall(2.0);
  SECTION("another size") {
    images.labels.ids.resize(100);
    const IntegrationReport report = mapper.integrate(images.depth, &images.labels, at(0), 0);
    CHECK(report.status == IntegrationStatus::kIntegrated);
    CHECK(report.label_size_differs);
    mapper.update_mesh();
    CHECK(mapper.mesh().mesh.labels.empty());
    CHECK(mapper.mesh().mesh.vertices.size() > 100);
  }
  SECTION("outside the palette") {
    const std::size_t columns = 160, half = columns / 2;
    for (std::size_t i = 0; i < images.labels.ids.size(); ++i)
      if (i % columns < half) images.labels.ids[i] = 77;
    const IntegrationReport report = mapper.integrate(images.depth, &images.labels, at(0), 0);
    CHECK(report.off_palette_pixels == images.labels.ids.size() / 2);
    CHECK_FALSE(report.label_size_differs);
    mapper.update_mesh();
    const MapMesh map = mapper.mesh();
    for (std::size_t i = 0; i < map.mesh.vertices.size(); ++i) {
      const float x = map.mesh.vertices[i].x();
      if (x < -0.11F) CHECK(map.mesh.labels[i] == 0);
      if (x > 0.11F) CHECK(map.mesh.labels[i] == 1);
    }
  }
}

TEST_CASE("Surface is meshed once enough images show it") {
  SemanticMappingConfig config = settings();
  // At a standard deviation of 0.08 m, means of three have 0.046 m, and means of two have 0.057 m.
  const bool is_noisy = GENERATE(false, true);
  CAPTURE(is_noisy);
  config.depth_sigma_per_m = is_noisy ? 0.02 : 0.0;
  config.max_range_m = 3.0;  // all voxels have one size
  config.min_views = is_noisy ? 1 : 3;
  SemanticMapper mapper(config, small_camera(), two_classes());
  for (KeyframeIndex looks = 1; looks <= 4; ++looks) {
    REQUIRE(integrate(mapper, wall(2.0), at(0), looks));
    mapper.update_mesh();
    CAPTURE(looks);
    CHECK((mapper.size().faces > 500) == (looks >= 3));
    CHECK((mapper.size().faces == 0) == (looks < 3));
  }
}

TEST_CASE("Vertices have the colours of the image, at one exposure") {
  SemanticMapper mapper(settings(0.05), small_camera(), two_classes());
  const DepthAndLabels images = wall(2.0);
  ColorImage color{images.depth.width, images.depth.height, {}};
  for (int v = 0; v < color.height; ++v)
    for (int u = 0; u < color.width; ++u)
      color.pixels.push_back(u < color.width / 2 ? ColorImage::Pixel{200, 40, 40}
                                                 : ColorImage::Pixel{40, 40, 120});
  for (KeyframeIndex look = 0; look < 4; ++look) {
    if (look == 2)  // a shorter exposure
      for (auto& pixel : color.pixels)
        for (auto& channel : pixel) channel = static_cast<std::uint8_t>(channel * 0.7);
    (void)mapper.integrate(images.depth, &images.labels, at(0), look, &color);
  }
  mapper.update_mesh();
  const LabelledMesh mesh = mapper.mesh().mesh;
  REQUIRE(mesh.colors.size() == mesh.vertices.size());
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    if (std::abs(mesh.vertices[i].x()) < 0.15F) continue;
    const ColorImage::Pixel expected = mesh.vertices[i].x() < 0.0F ? ColorImage::Pixel{200, 40, 40}
                                                                   : ColorImage::Pixel{40, 40, 120};
    for (std::size_t c = 0; c < 3; ++c) CHECK(std::abs(mesh.colors[i][c] - expected[c]) <= 3);
  }
}

TEST_CASE("The smallest voxels fit the depths") {
  const auto voxel_m = [&](std::uint16_t mm) {
    const DepthImage depth{4, 1, {0, mm, mm, 60000}};
    const std::vector images(2, std::make_shared<const DepthImage>(depth));
    return fitting_voxel_m({}, images);
  };
  CHECK(voxel_m(1400) == 0.02);
  CHECK(voxel_m(2200) == 0.03);
  CHECK(voxel_m(3000) == 0.05);
  CHECK(voxel_m(3300) == 0.1);
  CHECK(voxel_m(0) == 0.1);                                                    // unknown
  CHECK_THROWS_AS(SemanticMapper({}, small_camera()), std::invalid_argument);  // without images
}

TEST_CASE("Far surface has larger voxels until it is seen from near") {
  SemanticMappingConfig config = settings(0.05);
  config.depth_sigma_per_m = 0.01;  // bands up to 3.2, 4.5 and 6.3 m
  SemanticMapper mapper(config, small_camera(), two_classes());
  const auto look_from = [&](double z_m, KeyframeIndex first) {
    const SE3 T_odom_cam = make_pose(Eigen::Matrix3d::Identity(), {0.0, 0.0, z_m});
    for (KeyframeIndex i = 0; i < 30; ++i)
      REQUIRE(integrate(mapper, wall(5.03, false, T_odom_cam), T_odom_cam, first + i));
    mapper.update_mesh();
  };
  const auto faces_in_middle = [&] {
    const LabelledMesh mesh = mapper.mesh().mesh;
    std::size_t count = 0;
    for (const auto& [a, b, c] : mesh.faces) {
      const Eigen::Vector3f p = (mesh.vertices[a] + mesh.vertices[b] + mesh.vertices[c]) / 3.0F;
      CHECK(p.z() == Approx(5.03F).margin(0.01));
      count += p.head<2>().cwiseAbs().maxCoeff() < 0.6F ? 1 : 0;
    }
    return count;
  };
  const double area_m2 = 1.2 * 1.2;
  look_from(0.0, 0);
  CHECK(static_cast<double>(faces_in_middle()) == Approx(2.0 * area_m2 / 0.04).epsilon(0.2));
  look_from(3.0, 30);
  CHECK(static_cast<double>(faces_in_middle()) == Approx(2.0 * area_m2 / 0.0025).epsilon(0.1));
}

TEST_CASE("Carving removes an object that has gone") {
  SemanticMapper mapper(settings(0.05), small_camera(), two_classes());
  for (KeyframeIndex i = 0; i < 5; ++i) REQUIRE(integrate(mapper, wall(3.0, true), at(0), i));
  mapper.update_mesh();
  CHECK(vertices_before(mapper.mesh(), 2.0) > 200);

  const std::size_t blocks = mapper.size().blocks;
  for (KeyframeIndex i = 5; i < 25; ++i) {
    REQUIRE(integrate(mapper, wall(3.0), at(0), i));
    if (i % 3 == 0) mapper.update_mesh();
  }
  mapper.update_mesh();
  const MapMesh map = mapper.mesh();
  CHECK(vertices_before(map, 2.0) == 0);
  CHECK(mapper.size().blocks < blocks);
  CHECK(map.mesh.vertices.size() > vertices_before(map, 2.0) + 500);  // the wall
}

TEST_CASE("A repeated frame keeps every vertex and its first keyframe") {
  SemanticMapper mapper(settings(0.05), small_camera(), two_classes());
  // At the rim of the ball, voxels far behind the surface have small weights: few frames are too
  // few.
  for (int look = 0; look < 12; ++look) REQUIRE(integrate(mapper, wall(2.51, true), at(0), 4));
  CHECK(mapper.update_mesh() > 0);
  const MapMesh before = mapper.mesh();
  CHECK(before.ids.size() > 500);
  CHECK(mapper.update_mesh() == 0);
  REQUIRE(integrate(mapper, wall(2.51, true), at(0), 7));
  mapper.update_mesh();
  const MapMesh after = mapper.mesh();
  CHECK(after.ids == before.ids);
  CHECK(after.mesh.labels == before.mesh.labels);
  CHECK(after.mesh.faces.size() == before.mesh.faces.size());
  // Radius of the ball's silhouette at z = 1
  const float silhouette = 0.4F / std::sqrt(1.5F * 1.5F - 0.4F * 0.4F);
  for (std::size_t i = 0; i < after.ids.size(); ++i) {
    CHECK(before.seen_by[i] == std::array<KeyframeIndex, 2>{4, 4});
    CHECK(after.seen_by[i][0] == 4);
    CHECK((after.seen_by[i][1] == 4 || after.seen_by[i][1] == 7));
    // At the ball's rim the surface runs along the line of sight.
    const Eigen::Vector3f& p = after.mesh.vertices[i];
    const bool at_rim = std::abs(p.head<2>().norm() / p.z() - silhouette) < 0.025F;
    CHECK((after.seen_by[i][1] == 7 || at_rim));
    CHECK((after.mesh.vertices[i] - before.mesh.vertices[i]).norm() < 1e-5F);
  }
}

TEST_CASE("Surface that left the window is final and a revisit makes new vertices") {
  SemanticMappingConfig config = settings();
  config.window_m = 5.0;
  SemanticMapper mapper(config, small_camera(), two_classes());
  for (KeyframeIndex i = 0; i < 3; ++i) REQUIRE(integrate(mapper, wall(2.03), at(0), i));
  mapper.update_mesh();
  const MapMesh first = mapper.mesh();
  for (KeyframeIndex i = 3; i < 10; ++i) REQUIRE(integrate(mapper, wall(2.03), at(20), i));
  CHECK(mapper.size().final_faces > 0);
  for (KeyframeIndex i = 10; i < 12; ++i) REQUIRE(integrate(mapper, wall(2.08), at(0), i));
  mapper.update_mesh();
  const MapMesh last = mapper.mesh();
  CHECK(mapper.size().final_faces == 2 * first.mesh.faces.size());  // here, and 20 m away
  REQUIRE(std::includes(last.ids.begin(), last.ids.end(), first.ids.begin(), first.ids.end()));
  std::size_t anew = 0;
  for (std::size_t i = 0, old = 0; i < last.ids.size(); ++i) {
    if (old < first.ids.size() && last.ids[i] == first.ids[old]) {
      CHECK(last.seen_by[i] == first.seen_by[old]);
      CHECK(last.mesh.vertices[i] == first.mesh.vertices[old]);
      CHECK(last.mesh.labels[i] == first.mesh.labels[old++]);
    } else if (last.mesh.vertices[i].x() < 5.0F) {
      ++anew;
      CHECK(last.seen_by[i][0] >= 10);
      CHECK(last.mesh.vertices[i].z() == Approx(2.08F).margin(1e-3));
    }
  }
  CHECK(anew > 100);
}

// Along a wall, with a window shorter than the distance travelled: rim edges away from the wall's
// own border.
TEST_CASE("Mesh that became final during the motion has no cracks") {
  SemanticMappingConfig config = settings();
  config.window_m = 0.6;
  const KeyframeIndex meshed_every = GENERATE(1U, 7U, 100U);
  CAPTURE(meshed_every);
  SemanticMapper mapper(config, small_camera(), two_classes());
  for (KeyframeIndex i = 0; i < 60; ++i) {
    const SE3 T_odom_cam = at(0.15 * i, 0.02 * i);
    REQUIRE(integrate(mapper, wall(2.03, false, T_odom_cam), T_odom_cam, i));
    if (i % meshed_every == 0) mapper.update_mesh();
  }
  mapper.update_mesh();
  const MapSize size = mapper.size();
  CHECK(size.final_faces > size.faces / 2);
  const LabelledMesh mesh = mapper.mesh().mesh;
  std::size_t cracks = 0;
  for (const auto& [a, b] : rim_of(mesh)) {
    const Eigen::Vector3f p = 0.5F * (mesh.vertices[a] + mesh.vertices[b]);
    const float middle = p.x() * 0.02F / 0.15F;  // height of the camera at that position
    if (p.x() > -0.8F && p.x() < 9.6F && std::abs(p.y() - middle) < 0.6F) ++cracks;
  }
  CHECK(cracks == 0);
}

TEST_CASE("Blocks never exceed their bound and their mesh is not lost") {
  SemanticMappingConfig config = settings();
  config.max_blocks = 64;
  SemanticMapper mapper(config, small_camera(), two_classes());
  std::size_t refused = 0;
  for (KeyframeIndex i = 0; i < 80; ++i) {
    const SE3 T_odom_cam = at(0.25 * i);
    const DepthAndLabels images = wall(2.03, false, T_odom_cam);
    const IntegrationReport report = mapper.integrate(images.depth, &images.labels, T_odom_cam, i);
    refused += report.blocks_refused;
    CHECK(mapper.size().blocks <= 64);
  }
  CHECK(mapper.size().final_faces > 0);
  CHECK(refused == 0);
  mapper.update_mesh();
  // 20 m of wall, 1.8 m high.
  std::set<int> columns;
  for (const Eigen::Vector3f& p : mapper.mesh().mesh.vertices)
    columns.insert(static_cast<int>(std::floor(p.x() + 0.5F)));
  for (int x = 0; x < 20; ++x) CHECK(columns.contains(x));

  // A frame that alone needs more blocks: they are counted, and the bound holds.
  config.voxel_size_m = 0.02;
  SemanticMapper full(config, small_camera(), two_classes());
  CHECK(full.integrate(wall(2.03).depth, nullptr, at(0), 0).blocks_refused > 0);
  CHECK(full.size().blocks == 64);
}

TEST_CASE("Two threads give the same mesh as one, bit by bit") {
  const auto map_with = [](int threads) {
    cv::setNumThreads(threads);
    SemanticMapper mapper(settings(), small_camera(), BoxRoom::palette());
    for (int i = 0; i < 10; ++i) {
      const SE3 T_room_cam = BoxRoom::T_room_cam(3 * i);
      REQUIRE(integrate(mapper, render(small_camera(), T_room_cam, cast_room), T_room_cam,
                        static_cast<KeyframeIndex>(i)));
      mapper.update_mesh();
    }
    return mapper.mesh();
  };
  const MapMesh one = map_with(1), two = map_with(2);
  cv::setNumThreads(-1);
  CHECK(one.ids == two.ids);
  CHECK(one.seen_by == two.seen_by);
  CHECK(one.mesh.vertices == two.mesh.vertices);
  CHECK(one.mesh.labels == two.mesh.labels);
  CHECK(one.mesh.faces == two.mesh.faces);
}

}  // namespace
}  // namespace km
