#include <nlohmann/json.hpp>
#include <opencv2/core/utility.hpp>

#include "modules/evaluation/mesh/mesh_error.hpp"
#include "modules/evaluation/mesh/mesh_report.hpp"
#include "modules/evaluation/mesh/sampled_surface.hpp"
#include "test/modules/evaluation/mesh/shapes.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

MeshErrorOptions in_place(std::uint32_t seed = 1) {
  MeshErrorOptions options{.seed = seed, .icp = false};
  return options;
}

MeshReport compare(const LabelledMesh& truth, const LabelledMesh& estimate,
                   const MeshErrorOptions& options) {
  const std::vector<MeshInput> inputs = {{"a", estimate}};
  return mesh_error(truth, inputs, options);
}

// Mean distance from a point at height h above a plane to the nearest of random points on it. There
// are `density` points per square metre: P(r > x) = exp(-pi density x^2) in the plane.
double mean_distance(double h, double density) {
  const double a = std::numbers::pi * density;
  return h + std::exp(a * h * h) * std::erfc(h * std::sqrt(a)) / (2.0 * std::sqrt(density));
}

std::string json_of(const MeshReport& report) {
  return json_text(to_json(report, {}));
}

TEST_CASE("Two parallel planes have the error of their distance") {
  const double h = GENERATE(0.0, 0.01, 0.03, 0.08);
  const double density = GENERATE(250.0, 1000.0);
  CAPTURE(h, density);
  MeshErrorOptions options = in_place();
  options.samples_per_m2 = density;
  const MeshReport report =
      compare(square(6.0F, 0.0F, 1), square(6.0F, static_cast<float>(h), 1), options);
  // 9000 points or more: the mean of their distances is known to 1 %; the border adds as much.
  const double expected = mean_distance(h, density);
  for (const SurfaceComparison* way : {&report.merged.truth, &report.merged.estimate}) {
    CHECK(way->point.mean_m == Approx(expected).epsilon(0.03));
    CHECK(way->surface.mean_m == Approx(h).margin(1e-6));
    CHECK(way->surface.median_m == Approx(h).margin(1e-6));
    CHECK(way->surface.within_5cm == (h < 0.05 ? 1.0 : 0.0));
    CHECK(way->surface.within_10cm == 1.0);
    const double near = 1.0 - std::exp(-std::numbers::pi * density * (0.01 - h * h));
    CHECK(way->point.within_10cm == Approx(near).margin(0.01));
  }
  CHECK(report.merged.coverage == 1.0);
  CHECK(report.merged.beyond == 0.0);
  CHECK(report.samples_per_m2 == density);
}

TEST_CASE("Shares of right and wrong and unknown labels are those of the areas") {
  LabelledMesh truth = rectangle({0, 0, 0}, {5, 0, 0}, {0, 4, 0}, 8, 1);
  truth.append(rectangle({5, 0, 0}, {5, 0, 0}, {0, 4, 0}, 8, 7));
  // Class 1: 60 % right, 40 % called 7. Class 7: 50 % right, 30 % called 2, 20 % unknown.
  LabelledMesh estimate = rectangle({0, 0, 0}, {3, 0, 0}, {0, 4, 0}, 8, 1);
  estimate.append(rectangle({3, 0, 0}, {4.5F, 0, 0}, {0, 4, 0}, 8, 7));
  estimate.append(rectangle({7.5F, 0, 0}, {1.5F, 0, 0}, {0, 4, 0}, 8, 2));
  estimate.append(rectangle({9, 0, 0}, {1, 0, 0}, {0, 4, 0}, 8, 0));
  const MeshReport report = compare(truth, estimate, in_place(GENERATE(1U, 2U)));
  REQUIRE(report.has_labels);
  constexpr double kBorder = 0.01;  // 5 m wide classes, samples 3 cm apart
  const auto scores = report.merged.truth.labels.by_class();
  REQUIRE(scores.size() == 2);
  CHECK(scores[0].id == 1);
  CHECK(scores[0].accuracy() == Approx(0.6).margin(kBorder));
  CHECK(scores[0].unknown == 0);
  CHECK(scores[1].id == 7);
  CHECK(scores[1].accuracy() == Approx(0.5).margin(kBorder));
  const LabelScore total = report.merged.truth.labels.total();
  CHECK(total.accuracy() == Approx(0.55).margin(kBorder));
  CHECK(static_cast<double>(total.unknown) / static_cast<double>(total.points()) ==
        Approx(0.1).margin(kBorder));
  CHECK(report.merged.estimate.labels.total().accuracy() == Approx(0.55).margin(kBorder));
}

TEST_CASE("Labels beyond the given distance or of unknown true class are not judged") {
  MeshErrorOptions options = in_place();
  options.label_distance_m = 0.2;
  const float z = GENERATE(0.15F, 0.25F);
  const MeshReport report = compare(square(3.0F, 0.0F), square(3.0F, z), options);
  CHECK(report.merged.truth.labels.total().points() == (z < 0.2F ? 9000 : 0));
  CHECK(std::isnan(report.merged.truth.labels.total().accuracy()) == (z > 0.2F));
  const MeshReport unknown = compare(square(3.0F, 0.0F, 4, 0), square(3.0F, z, 4, 3), options);
  CHECK(unknown.merged.truth.labels.total().points() == 0);
}

TEST_CASE("True points far from the estimate are not judged") {
  LabelledMesh estimate = square(2.0F, 0.0F);
  estimate.transform(make_pose(Eigen::Matrix3d::Identity(), {4, 4, 0}));
  const MeshReport report = compare(square(10.0F, 0.0F), estimate, in_place());
  // The square, four strips of half a metre, four quarters of a disc.
  const double area = 4.0 + 4.0 * 2.0 * 0.5 + std::numbers::pi * 0.25;
  CHECK(report.merged.coverage == Approx(area / 100.0).epsilon(0.02));
  CHECK(report.merged.estimate.surface.mean_m < 1e-4);
  MeshErrorOptions all = in_place();
  all.crop_m = 20.0;
  CHECK(compare(square(10.0F, 0.0F), estimate, all).merged.coverage == 1.0);
}

TEST_CASE("True points beyond the rim of the estimate or behind it count separately") {
  // A wall with a thickness of 0.2 m, of which a part of one side was seen.
  LabelledMesh truth = rectangle({0, 0, 0}, {4, 0, 0}, {0, 0, 2}, 8, 1);
  truth.append(rectangle({0, 0.2F, 0}, {0, 0, 2}, {4, 0, 0}, 8, 2));
  const LabelledMesh estimate = rectangle({0, -0.03F, 0}, {3, 0, 0}, {0, 0, 2}, 8, 1);
  const MeshReport report = compare(truth, estimate, in_place());
  CHECK(report.merged.coverage > 0.8);
  CHECK(report.merged.truth.surface.mean_m > 0.1);
  CHECK(report.merged.seen_coverage == Approx(6.0 / 16.0).margin(0.01));
  CHECK(report.merged.seen.surface.mean_m == Approx(0.03).margin(1e-5));
  CHECK(report.merged.seen.labels.total().accuracy() == 1.0);
}

TEST_CASE("Surface that the truth lacks counts with the crop distance") {
  LabelledMesh estimate = square(2.0F, 0.0F);
  estimate.append(square(1.0F, 3.0F));  // a fifth of the estimate, above the truth
  const MeshReport report = compare(square(2.0F, 0.0F), estimate, in_place());
  CHECK(report.merged.beyond == Approx(0.2).margin(1e-3));
  CHECK(report.merged.estimate.surface.mean_m == Approx(0.1).margin(1e-3));
  CHECK(report.merged.truth.surface.mean_m < 1e-4);
}

TEST_CASE("Several robots are judged separately and merged") {
  LabelledMesh left = rectangle({0, 0, 0}, {3, 0, 0}, {0, 4, 0}, 8, 1);
  LabelledMesh right = rectangle({2, 0, 0.04F}, {4, 0, 0}, {0, 4, 0}, 8, 2);
  const std::vector<MeshInput> inputs = {{"left", left}, {"right", right}};
  MeshErrorOptions options = in_place();
  options.crop_m = 0.1;
  const LabelledMesh truth = rectangle({0, 0, 0}, {6, 0, 0}, {0, 4, 0}, 8, 1);
  const MeshReport report = mesh_error(truth, inputs, options);
  REQUIRE(report.robots.size() == 2);
  CHECK(report.robots[0].name == "left");
  CHECK(report.robots[0].coverage == Approx(0.5 + 0.1 / 6.0).margin(0.01));
  CHECK(report.robots[1].coverage == Approx(4.0 / 6.0 + 0.09 / 6.0).margin(0.01));
  CHECK(report.robots[1].estimate.surface.mean_m == Approx(0.04).margin(1e-6));
  CHECK(report.merged.name == "merged");
  CHECK(report.merged.area_m2 == Approx(28.0));
  CHECK(report.merged.coverage == 1.0);
  CHECK(report.merged.estimate.point.count == 28'000);
  CHECK(report.merged.estimate.surface.mean_m == Approx(0.04 * 16.0 / 28.0).margin(1e-5));
  // In their common part the nearer one counts: half of the truth is at 0, half at 4 cm.
  CHECK(report.merged.truth.surface.mean_m == Approx(0.02).margin(6e-4));
  CHECK(report.merged.truth.labels.total().accuracy() == Approx(0.5).margin(0.02));
}

TEST_CASE("Two states of a mesh are judged on the points that either of them shows") {
  const LabelledMesh truth = rectangle({0, 0, 0}, {10, 0, 0}, {0, 4, 0}, 8, 1);
  const LabelledMesh part = rectangle({0, 0, 0.05F}, {6, 0, 0}, {0, 4, 0}, 8, 1);
  const LabelledMesh whole = rectangle({0, 0, 0.02F}, {10, 0, 0}, {0, 4, 0}, 8, 2);
  const std::vector<MeshInput> first = {{"first", part}}, second = {{"second", whole}};
  MeshErrorOptions options = in_place();
  options.crop_m = 0.1;
  options.label_distance_m = 0.08;
  const bool gains = GENERATE(true, false);
  const MeshChange change =
      mesh_change(truth, gains ? first : second, gains ? second : first, options);
  const MeshError& of_part = (gains ? change.before : change.after).merged;
  const MeshError& of_whole = (gains ? change.after : change.before).merged;
  CHECK(of_part.name == "first");
  CHECK(of_part.truth.point.count == of_whole.truth.point.count);
  CHECK(of_part.seen.point.count == of_whole.seen.point.count);
  CHECK(of_whole.truth.surface.mean_m == Approx(0.02).margin(1e-6));
  // 6 m at 5 cm, and the rest at the crop distance except for 9 cm beside the rim.
  CHECK(of_part.truth.surface.mean_m == Approx(0.6 * 0.05 + 0.4 * 0.1).margin(5e-4));
  CHECK(of_part.coverage == Approx(0.609).margin(0.003));
  CHECK(of_whole.coverage == 1.0);
  // Labels are judged at all points; the part is right where it is near.
  CHECK(of_part.truth.labels.total().points() == of_whole.truth.labels.total().points());
  CHECK(of_part.truth.labels.total().accuracy() == Approx(0.606).margin(0.003));
  CHECK(of_whole.truth.labels.total().accuracy() == 0.0);
}

TEST_CASE("The same arguments give the same report on any number of threads") {
  LabelledMesh estimate = room();
  estimate.transform(make_pose(Eigen::Matrix3d::Identity(), {0.02, 0.01, 0.03}));
  const int threads = cv::getNumThreads();
  cv::setNumThreads(1);
  const std::string one = json_of(compare(room(), estimate, {}));
  cv::setNumThreads(4);
  const std::string four = json_of(compare(room(), estimate, {}));
  cv::setNumThreads(threads);
  CHECK(one == four);
  MeshErrorOptions other{.seed = 2};
  CHECK(one != json_of(compare(room(), estimate, other)));
}

TEST_CASE("More samples than allowed lower the density of both sides, with a note") {
  MeshErrorOptions options = in_place();
  options.max_samples = 5000;
  const MeshReport report = compare(square(10.0F, 0.0F), square(5.0F, 0.0F), options);
  CHECK(report.merged.estimate.point.count <= 5000);
  CHECK(report.merged.truth.point.count <= 5000);
  CHECK(report.merged.truth.point.count > 3500);
  CHECK(report.samples_per_m2 < 200.0);
  REQUIRE(report.notes.size() == 1);
  CHECK_THAT(report.notes[0],
             StartsWith("sampled at 1") && Contains("instead of 1000, to stay below 5000"));
}

TEST_CASE("A face with a vertex far away is left out, and such a truth is refused") {
  LabelledMesh estimate = square(6.0F, 0.02F, 1);
  estimate.vertices.emplace_back(1e6F, 1e6F, 0.0F);
  estimate.labels.push_back(1);
  estimate.faces.push_back({0, 1, static_cast<std::uint32_t>(estimate.vertices.size() - 1)});
  const MeshReport report = compare(square(6.0F, 0.0F, 1), estimate, in_place());
  CHECK(report.merged.estimate.surface.mean_m == Approx(0.02).margin(1e-6));
  CHECK(report.merged.area_m2 == Approx(36.0));
  REQUIRE(report.notes.size() == 1);
  CHECK_THAT(report.notes[0], StartsWith("1 faces are longer than ten times the truth, 84.9 m"));
  CHECK_THROWS_WITH(compare(estimate, estimate, in_place()), Contains("has it a vertex far away?"));
}

TEST_CASE("Meshes without labels are compared by shape, with a note") {
  LabelledMesh bare = square(1.0F, 0.0F);
  bare.labels.clear();
  const MeshReport report = compare(square(1.0F, 0.0F), bare, in_place());
  CHECK_FALSE(report.has_labels);
  REQUIRE(report.notes.size() == 1);
  CHECK(report.notes[0] == "labels are not judged: none in a");
  CHECK_THAT(json_of(report), Contains("\"labels\": null"));
  CHECK_THAT(to_table(report, {}), !Contains("True class"));
}

TEST_CASE("Meshes that cannot be compared are refused by name") {
  const LabelledMesh good = square(1.0F, 0.0F);
  const auto changed = [&](const auto& change) {
    LabelledMesh mesh = good;
    change(mesh);
    return mesh;
  };
  const std::vector<std::pair<LabelledMesh, std::string>> refused = {
      {changed([](LabelledMesh& mesh) { mesh.faces.clear(); }),
       "a: no faces, so no surface to compare"},
      {changed([](LabelledMesh& mesh) { mesh.faces[3][1] = 1000; }),
       "a: a face names vertex 1000 of 81"},
      {changed([](LabelledMesh& mesh) {
         for (auto& vertex : mesh.vertices) vertex.setZero();
       }),
       "a: its faces have no area"},
      {changed([](LabelledMesh& mesh) { mesh.vertices[0].x() = std::nanf(""); }),
       "a: coordinates that are not finite"},
      {changed([](LabelledMesh& mesh) { mesh.labels.pop_back(); }), "a: 80 labels for 81 vertices"},
      {square(0.01F, 0.0F), "a: too small for a single"},
      {square(1.0F, 50.0F), "are both in one frame?"}};
  for (const auto& [mesh, message] : refused)
    CHECK_THROWS_WITH(compare(good, mesh, {}), Contains(message));
  CHECK_THROWS_WITH(compare({}, good, {}), StartsWith("truth: no faces"));
  MeshErrorOptions options{.crop_m = -1.0};
  CHECK_THROWS_WITH(compare(good, good, options), StartsWith("a reach of -1"));
  CHECK_THROWS_AS(mesh_error(good, {}, {}), std::invalid_argument);
  const std::vector<MeshInput> one = {{"a", good}}, two = {{"a", good}, {"b", good}};
  CHECK_THROWS_WITH(mesh_change(good, one, two), Contains("1 meshes before and 2 after"));
}

TEST_CASE("A mesh ends at an edge of one face with shared and with separate vertices") {
  const bool shared = GENERATE(true, false);
  LabelledMesh mesh = square(3.0F, 0.0F, 3);
  if (!shared) {
    LabelledMesh soup;
    for (const auto& face : mesh.faces) {
      const auto first = static_cast<std::uint32_t>(soup.vertices.size());
      for (const std::uint32_t corner : face) soup.vertices.push_back(mesh.vertices[corner]);
      soup.faces.push_back({first, first + 1, first + 2});
    }
    mesh = soup;
  }
  const SurfaceSamples samples = sample_surface(mesh, 1000.0, 1);
  const NearestSurface nearest(mesh, samples);
  for (const float x : {0.1F, 1.0F, 1.5F, 2.9F})  // also at edges and corners of faces
    CHECK_FALSE(nearest.find({x, 1.0F, 0.2F}, 1.0)->past_boundary);
  CHECK(nearest.find({3.1F, 1.0F, 0.2F}, 1.0)->past_boundary);
  CHECK(nearest.find({3.1F, 3.1F, 0.0F}, 1.0)->past_boundary);
  CHECK(nearest.find({3.3F, 3.4F, 0.0F}, 1.0)->surface_m == Approx(0.5F));
}

TEST_CASE("The nearest sample is that of brute force") {
  const unsigned seed = GENERATE(1U, 2U, 3U);
  CAPTURE(seed);
  const LabelledMesh mesh = room();
  const SurfaceSamples samples = sample_surface(mesh, 20.0, seed);
  const NearestSurface nearest(mesh, samples);
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> uniform(-1.0F, 5.0F);
  for (int i = 0; i < 200; ++i) {
    const float x = uniform(random), y = uniform(random), z = uniform(random);
    const Eigen::Vector3f point(x, y, z);
    float best = std::numeric_limits<float>::infinity();
    for (const Eigen::Vector3f& sample : samples.points)
      best = std::min(best, (sample - point).norm());
    const auto found = nearest.find(point, 10.0);
    REQUIRE(found);
    CHECK(found->distance_m == Approx(best).epsilon(1e-5));
    CHECK(found->surface_m <= found->distance_m);
    CHECK_FALSE(nearest.find(point, 0.99 * static_cast<double>(best)));
    CHECK(nearest.find(point, 1.01 * static_cast<double>(best)));
  }
  CHECK_FALSE(NearestSurface({}, {}).find({0, 0, 0}, 10.0));
}

}  // namespace
}  // namespace km
