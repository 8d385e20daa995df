#include "modules/mesh_deformation/superseded_surface.hpp"
#include "test/modules/mesh_deformation/corridor.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr double kVoxel_m = 0.25;
constexpr KeyframeIndex kVisit = 200;  // keyframes from one visit to the next
const SheetSize kSheet{.columns = 20, .rows = 8, .step_m = kVoxel_m, .keyframe_step_m = 0.5};
const SameSurface kSameSurface{
    .distance_m = kVoxel_m, .longest_edge_m = 2 * kVoxel_m, .max_gap_keyframes = 15};

// Several sheets in one mesh, each seen `later` keyframes after the one before.
MapMesh visits(const std::vector<MapMesh>& sheets, KeyframeIndex later = kVisit) {
  MapMesh all;
  KeyframeIndex shift = 0;
  for (const MapMesh& visit : sheets) {
    all.mesh.append(visit.mesh);
    for (const auto& [first, last] : visit.seen_by) {
      all.seen_by.push_back({first + shift, last + shift});
      all.ids.push_back(all.ids.size());
    }
    shift += later;
  }
  return all;
}

MapMesh sheet_at(const Eigen::Vector3d& t) {
  MapMesh result = sheet(kSheet);
  result.mesh.transform(make_pose(Eigen::Matrix3d::Identity(), t));
  return result;
}

LabelledMesh cleaned(const MapMesh& map) {
  return without_superseded(
      map.mesh, find_replacements(map.mesh, {map.seen_by, map.certainty}, kSameSurface));
}

TEST_CASE("The newer of two copies of a surface stays in any order of the mesh") {
  const double height_m = GENERATE(0.9, -0.9, 0.0) * kVoxel_m;
  CAPTURE(height_m);
  const MapMesh older = sheet_at({0, 0, 0}), newer = sheet_at({0, 0, height_m});
  const MapMesh map = visits({older, newer});
  CHECK(cleaned(map).vertices == newer.mesh.vertices);
  CHECK(cleaned(map).faces == newer.mesh.faces);
  CHECK(cleaned(map).labels == newer.mesh.labels);

  MapMesh other_order = map;
  std::rotate(other_order.seen_by.begin(), other_order.seen_by.begin() + std::ssize(older.seen_by),
              other_order.seen_by.end());
  CHECK(cleaned(other_order).vertices == older.mesh.vertices);
}

TEST_CASE("The more certain of two copies stays") {
  const MapMesh older = sheet_at({0, 0, 0}), newer = sheet_at({0, 0, 0.1});
  MapMesh map = visits({older, newer});
  map.certainty.assign(map.ids.size(), 5);
  const std::size_t count = older.ids.size();
  SECTION("the older everywhere") {
    std::fill(map.certainty.begin() + std::ssize(older.ids), map.certainty.end(), 4);
    CHECK(cleaned(map).vertices == older.mesh.vertices);
  }
  SECTION("the older on one side and no surface is lost in between") {
    for (std::size_t v = 0; v < count; ++v)
      if (older.mesh.vertices[v].x() > 2.6F) map.certainty[count + v] = 4;
    const LabelledMesh result = cleaned(map);
    CHECK(result.faces.size() >= older.mesh.faces.size());
    CHECK(result.faces.size() <= older.mesh.faces.size() + 4 * 2 * kSheet.rows);  // the seam
    for (std::size_t f = 0; f < result.faces.size(); ++f) {
      const Eigen::Vector3f& p = result.vertices[result.faces[f][0]];
      // The certainty around a vertex is an average over some edges.
      if (std::abs(p.x() - 2.6F) > 3.0F * float{kVoxel_m}) CHECK((p.z() > 0.05F) == (p.x() < 2.6F));
    }
  }
}

TEST_CASE("As many of the newest copies stay as are asked for") {
  std::vector<MapMesh> sheets;
  for (int i = 0; i < 5; ++i) sheets.push_back(sheet_at({0, 0, 0.02 * i}));
  const MapMesh map = visits(sheets);
  SameSurface same = kSameSurface;
  for (same.copies = 1; same.copies <= 6; ++same.copies) {
    CAPTURE(same.copies);
    const LabelledMesh left = without_superseded(
        map.mesh, find_replacements(map.mesh, {map.seen_by, map.certainty}, same));
    const std::size_t stay = std::min<std::size_t>(same.copies, 5);
    const std::size_t count = sheets[0].mesh.vertices.size();
    const auto newest = static_cast<std::ptrdiff_t>((5 - stay) * count);
    CHECK(left.vertices ==
          std::vector(map.mesh.vertices.begin() + newest, map.mesh.vertices.end()));
    CHECK(left.faces.size() == stay * sheets[0].mesh.faces.size());
  }
}

// Noise lifts a scrap of the older copy off the newer one.
TEST_CASE("A scrap of few faces goes with the copy around it, and a larger one stays") {
  const int lifted = GENERATE(1, 4);  // 6 and 30 faces have a lifted corner
  CAPTURE(lifted);
  MapMesh older = sheet_at({0, 0, 0});
  const MapMesh newer = sheet_at({0, 0, 0});
  std::size_t count = 0;
  for (Eigen::Vector3f& p : older.mesh.vertices)
    if (p.x() > 2.0F && p.x() < 2.05F + 0.25F * static_cast<float>(lifted) && p.y() > 0.7F &&
        p.y() < 0.75F + 0.25F * static_cast<float>(std::min(lifted, 2))) {
      p.z() = 0.3F;
      ++count;
    }
  REQUIRE(count == (lifted == 1 ? 1 : 8));
  const LabelledMesh left = cleaned(visits({older, newer}));
  const bool stays = std::ranges::any_of(left.vertices, [](const auto& p) { return p.z() > 0.2F; });
  CHECK(stays == (lifted == 4));
}

TEST_CASE("The replacement of a vertex is its copy by id") {
  const MapMesh map = visits({sheet_at({0, 0, 0}), sheet_at({0.05, 0.03, 0.1})});
  const auto count = static_cast<std::uint32_t>(map.ids.size() / 2);
  const auto replacements = find_replacements(map.mesh, {map.seen_by, map.certainty}, kSameSurface);
  for (std::uint32_t v = 0; v < count; ++v) CHECK(replacements[v] == v + count);  // at the rim too
  for (std::uint32_t v = count; v < 2 * count; ++v) CHECK(replacements[v] == kNoIndex);

  std::vector<std::uint64_t> ids;
  for (std::uint64_t v = 0; v < 2 * count; ++v) ids.push_back(10 * v + 3);
  const SupersededSurface surface = named(replacements, ids);
  REQUIRE(surface.vertices.size() == count);
  CHECK(surface.vertices[7].id == 73);
  CHECK(surface.vertices[7].replacement == 10 * (7 + count) + 3);
}

TEST_CASE("Two different surfaces both stay") {
  MapMesh second = sheet_at({0, 0, 0});
  KeyframeIndex later = kVisit;
  SECTION("more than the distance apart") {
    second = sheet_at({0, 0, 1.05 * kVoxel_m});
  }
  SECTION("side by side") {
    second = sheet_at({0, 2.5, 0});
  }
  SECTION("the two sides of a thin wall") {
    for (auto& face : second.mesh.faces) std::swap(face[0], face[1]);
  }
  SECTION("seen on one visit") {
    later = 15;
  }
  const MapMesh map = visits({sheet_at({0, 0, 0}), second}, later);
  const LabelledMesh result = cleaned(map);
  CHECK(result.faces == map.mesh.faces);
  CHECK(result.vertices == map.mesh.vertices);
}

TEST_CASE("Surface that the newer visit did not see stays up to its rim") {
  // The sheet is 5 m long
  const MapMesh older = sheet_at({0, 0, 0}), newer = sheet_at({2.1, 0, 0.1});
  const LabelledMesh result = cleaned(visits({older, newer}));
  const float rim_m = 2.1F - 0.25F * static_cast<float>(kSameSurface.distance_m);
  std::size_t expected = newer.mesh.faces.size();
  for (const auto& [a, b, c] : older.mesh.faces)
    expected += std::min({older.mesh.vertices[a].x(), older.mesh.vertices[b].x(),
                          older.mesh.vertices[c].x()}) < rim_m
                    ? 1
                    : 0;
  CHECK(result.faces.size() == expected);
  CHECK(result.vertices.size() == result.labels.size());
}

// At the edge the normals of neither wall pass through points outside both.
TEST_CASE("A copy of a convex edge is dropped as a whole") {
  const auto roof = [](double larger_m) {
    MapMesh result = sheet(kSheet);
    for (Eigen::Vector3f& p : result.mesh.vertices) {
      const float x = p.x() - 2.5F;
      p = Eigen::Vector3f(x, p.y(), static_cast<float>(larger_m) - std::abs(x));
    }
    return result;
  };
  const MapMesh larger = roof(0.08), smaller = roof(0.0);
  CHECK(cleaned(visits({larger, smaller})).vertices == smaller.mesh.vertices);
  CHECK(cleaned(visits({smaller, larger})).vertices == larger.mesh.vertices);
}

// The certainty of a vertex depends on few frames and differs between neighbours. No copy is then
// the most certain one everywhere.
TEST_CASE("About one of many copies stays if their certainties differ from vertex to vertex") {
  const auto seed = GENERATE(range(0U, 3U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  std::normal_distribution<float> noise(0.0F, 0.04F);
  std::uniform_int_distribution<int> certainty(5, 7);
  std::vector<MapMesh> copies(6, sheet_at({0, 0, 0}));
  for (MapMesh& copy : copies)
    for (Eigen::Vector3f& p : copy.mesh.vertices) {
      p.x() += noise(rng);
      p.y() += noise(rng);
      p.z() += noise(rng);
    }
  MapMesh map = visits(copies);
  for (std::size_t v = 0; v < map.ids.size(); ++v)
    map.certainty.push_back(static_cast<std::uint8_t>(certainty(rng)));
  const std::size_t one = copies[0].mesh.faces.size();
  const std::size_t left = cleaned(map).faces.size();
  CHECK(left >= one * 9 / 10);
  CHECK(left < one * 3 / 2);  // a copy ends with a seam of whole faces where a better one begins
}

TEST_CASE("A mesh without faces and one with a face without area have no replacements") {
  CHECK(find_replacements({}, {{}, {}}, kSameSurface).empty());
  LabelledMesh mesh;
  mesh.vertices.assign(6, Eigen::Vector3f::Zero());
  mesh.faces = {{0, 1, 2}, {3, 4, 5}};
  const std::vector<SeenBy> seen_by = {{0, 0}, {0, 0}, {0, 0}, {90, 90}, {90, 90}, {90, 90}};
  CHECK(find_replacements(mesh, {seen_by, {}}, kSameSurface) == std::vector(6, kNoIndex));
}

}  // namespace
}  // namespace km
