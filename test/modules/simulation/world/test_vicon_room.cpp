#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "modules/core/text_rows.hpp"
#include "modules/simulation/world/seeded_random.hpp"
#include "modules/simulation/world/world.hpp"
#include "test/support/command.hpp"
#include "test/support/shared_data.hpp"

namespace km {
namespace {

using Eigen::AlignedBox3f;
using Eigen::Vector3f;

std::array<Vector3f, 3> corners(const SurfaceMesh& mesh, std::size_t triangle) {
  const auto& [a, b, c] = mesh.triangles[triangle];
  return {mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]};
}

AlignedBox3f bounds(const std::array<Vector3f, 3>& t) {
  return AlignedBox3f(t[0]).extend(t[1]).extend(t[2]);
}

float distance_to_edge(const Vector3f& p, const Vector3f& a, const Vector3f& b) {
  const float share = std::clamp((p - a).dot(b - a) / (b - a).squaredNorm(), 0.0F, 1.0F);
  return (a + share * (b - a) - p).norm();
}

float distance(const Vector3f& p, const std::array<Vector3f, 3>& t) {
  const Vector3f n = (t[1] - t[0]).cross(t[2] - t[0]).normalized();
  bool above = true;
  float nearest = std::numeric_limits<float>::infinity();
  for (std::size_t i = 0; i < 3; ++i) {
    const Vector3f& a = t[i];
    const Vector3f& b = t[(i + 1) % 3];
    above = above && n.cross(b - a).dot(p - a) >= 0.0F;
    nearest = std::min(nearest, distance_to_edge(p, a, b));
  }
  return above ? std::abs(n.dot(p - t[0])) : nearest;
}

bool ray_hits(const Vector3f& from, const Vector3f& d, const std::array<Vector3f, 3>& t) {
  // Moeller and Trumbore, "Fast, minimum storage ray/triangle intersection", 1997.
  const Vector3f e1 = t[1] - t[0];
  const Vector3f e2 = t[2] - t[0];
  const Vector3f p = d.cross(e2);
  const float det = e1.dot(p);
  if (std::abs(det) < 1e-12F) return false;
  const Vector3f to = from - t[0];
  const float u = to.dot(p) / det;
  const Vector3f q = to.cross(e1);
  const float v = d.dot(q) / det;
  return u >= 0.0F && v >= 0.0F && u + v <= 1.0F && e2.dot(q) / det > 0.0F;
}

/// Positions of a recorded flight, one in `keep_every`; the file may be gzipped.
std::vector<Vector3f> flight(const std::filesystem::path& file, std::size_t keep_every) {
  const bool zipped = file.extension() == ".gz";
  const CommandResult text = run_command((zipped ? "gzip -dc " : "cat ") + file.string());
  REQUIRE(text.exit_code == 0);
  std::vector<Vector3f> positions;
  const std::vector<TextRow> rows = split_rows(text.output);
  for (std::size_t i = 0; i < rows.size(); i += keep_every) {
    const auto number = [&](std::size_t field) {
      return static_cast<float>(parse_double(rows[i].fields.at(field)).value());
    };
    positions.emplace_back(number(1), number(2), number(3));
  }
  return positions;
}

}  // namespace

TEST_CASE("The Vicon room is a valid mesh with every class of an indoor world",
          "[simulation][room]") {
  const auto seed = GENERATE(range(1U, 5U));
  CAPTURE(seed);
  const World world = make_vicon_room(seed);
  const SurfaceMesh& mesh = world.mesh;
  REQUIRE(mesh.normals.size() == mesh.vertices.size());
  REQUIRE(mesh.uv.size() == mesh.vertices.size());
  REQUIRE(mesh.materials.size() == mesh.triangles.size());
  const AlignedBox3f room(Vector3f(-4.6F, -3.5F, 0.0F), Vector3f(3.4F, 4.5F, 4.0F));
  const AlignedBox3f with_niches(room.min() - Vector3f(0.2F, 0.2F, 0.02F),
                                 room.max() + Vector3f(0.2F, 0.2F, 0.02F));
  CHECK(std::all_of(mesh.vertices.begin(), mesh.vertices.end(),
                    [&](const Vector3f& v) { return with_niches.contains(v); }));
  CHECK(std::all_of(mesh.normals.begin(), mesh.normals.end(),
                    [](const Vector3f& n) { return std::abs(n.norm() - 1.0F) < 1e-4F; }));
  CHECK(std::all_of(mesh.uv.begin(), mesh.uv.end(),
                    [](const Eigen::Vector2f& uv) { return uv.allFinite(); }));
  std::set<SurfaceClass> seen;
  std::size_t flipped = 0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    REQUIRE(*std::max_element(mesh.triangles[i].begin(), mesh.triangles[i].end()) <
            mesh.vertices.size());
    REQUIRE(mesh.materials[i] < world.materials.size());
    seen.insert(world.materials[mesh.materials[i]].label);
    const auto t = corners(mesh, i);
    const Vector3f n = (t[1] - t[0]).cross(t[2] - t[0]);
    for (const std::uint32_t v : mesh.triangles[i]) flipped += n.dot(mesh.normals[v]) <= 0.0F;
  }
  CHECK(flipped == 0);
  CHECK(seen == std::set{SurfaceClass::kWall, SurfaceClass::kFloor, SurfaceClass::kCeiling,
                         SurfaceClass::kFurniture, SurfaceClass::kCurtain, SurfaceClass::kObject});
  for (const Material& material : world.materials) {
    CHECK(material.base < world.textures.size());
    CHECK(material.detail < world.textures.size());
  }
  CHECK(world.lighting.sun == 0.0F);
  CHECK_FALSE(world.lighting.lamps.empty());
  for (const Lighting::Lamp& lamp : world.lighting.lamps) CHECK(room.contains(lamp.position));
}

TEST_CASE("The flight volume of the Vicon room is empty, and its sky is not seen",
          "[simulation][room]") {
  const auto seed = GENERATE(range(1U, 5U));
  CAPTURE(seed);
  const World world = make_vicon_room(seed);
  const AlignedBox3f volume = world.flight_volume.cast<float>();
  REQUIRE(volume.volume() > 50.0F);
  std::vector<Vector3f> directions;
  SeededRandom random(seed);
  for (int i = 0; i < 300; ++i) {
    const float z = random.uniform(-1.0F, 1.0F);
    const float angle = random.uniform(0.0F, 6.2832F);
    const float r = std::sqrt(1.0F - z * z);
    directions.emplace_back(r * std::cos(angle), r * std::sin(angle), z);
  }
  std::vector<bool> ends(directions.size(), false);
  std::size_t inside = 0;
  for (std::size_t i = 0; i < world.mesh.triangles.size(); ++i) {
    const auto t = corners(world.mesh, i);
    inside += bounds(t).intersects(volume) ? 1U : 0U;
    for (std::size_t k = 0; k < directions.size(); ++k)
      ends[k] = ends[k] || ray_hits(volume.center(), directions[k], t);
  }
  CHECK(inside == 0);
  CHECK(std::count(ends.begin(), ends.end(), false) == 0);
}

TEST_CASE("Seeds furnish the Vicon room differently, each always alike", "[simulation][room]") {
  const World one = make_vicon_room(1);
  CHECK(make_vicon_room(1).mesh.vertices == one.mesh.vertices);
  CHECK(make_vicon_room(2).mesh.vertices != one.mesh.vertices);
  CHECK(make_vicon_room(5).mesh.vertices != one.mesh.vertices);
}

TEST_CASE("The recorded flights stay clear of everything in the Vicon room", "[simulation][room]") {
  constexpr float kClear_m = 0.25F;
  const auto euroc = shared_data("euroc");
  if (!euroc) return;
  std::vector<Vector3f> positions;
  AlignedBox3f reach;
  // 20 to 200 rows a second at up to 2.5 m/s: no flight gets 3 cm nearer between two samples.
  const auto add = [&](const std::string& file, std::size_t keep_every) {
    for (const Vector3f& p : flight(*euroc / file, keep_every)) {
      positions.push_back(p);
      reach.extend(p);
    }
  };
  add("V1_01_easy/mav0/state_groundtruth_estimate0/data.csv", 1);
  for (const std::string name :
       {"V1_02_medium", "V1_03_difficult", "V2_01_easy", "V2_02_medium", "V2_03_difficult"}) {
    add("groundtruth_only/" + name + ".csv.gz", 4);
  }
  REQUIRE(positions.size() > 20000);
  reach = AlignedBox3f(reach.min() - Vector3f::Constant(kClear_m),
                       reach.max() + Vector3f::Constant(kClear_m));
  const auto seed = GENERATE(range(1U, 5U));
  CAPTURE(seed);
  const World world = make_vicon_room(seed);
  float nearest = std::numeric_limits<float>::infinity();
  for (std::size_t i = 0; i < world.mesh.triangles.size(); ++i) {
    const auto t = corners(world.mesh, i);
    const AlignedBox3f box = bounds(t);
    if (!box.intersects(reach)) continue;
    for (const Vector3f& p : positions) {
      if (box.squaredExteriorDistance(p) < nearest * nearest)
        nearest = std::min(nearest, distance(p, t));
    }
  }
  CHECK(nearest >= kClear_m);
}

}  // namespace km
