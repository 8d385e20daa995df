#include "modules/mesh/chunk_packing.hpp"
#include "test/modules/mesh/wavy_sheet.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

ChunkCounts counts_of(const MeshChunk& chunk) {
  return {.vertices = chunk.offsets.size(),
          .faces = chunk.faces.size(),
          .labelled = !chunk.labels.empty(),
          .coloured = !chunk.colors.empty(),
          .seen = !chunk.views.empty()};
}

// The chunk after packing and unpacking.
MeshChunk unpacked(const MeshChunk& chunk) {
  MeshChunk result = chunk;
  result.offsets.clear();
  result.faces.clear();
  result.labels.clear();
  result.colors.clear();
  result.views.clear();
  CHECK(unpack(packed(chunk), counts_of(chunk), result));
  return result;
}

// A chunk of a sheet, with its vertices in a random order.
MeshChunk shuffled_chunk() {
  LabelledMesh mesh = wavy_sheet(38, 0.05);
  std::vector<std::uint32_t> place(mesh.vertices.size());
  for (std::uint32_t v = 0; v < place.size(); ++v) place[v] = v;
  std::mt19937 rng(5);
  std::shuffle(place.begin(), place.end(), rng);
  const LabelledMesh ordered = mesh;
  for (std::size_t v = 0; v < place.size(); ++v) {
    mesh.vertices[place[v]] = ordered.vertices[v];
    mesh.labels[place[v]] = ordered.labels[v];
  }
  for (auto& face : mesh.faces)
    for (std::uint32_t& corner : face) corner = place[corner];
  MeshOrigin origin{.seen_by = {}, .T_world_kf = std::vector(9, SE3::Identity()), .mapped = {}};
  using Seen = std::array<KeyframeIndex, 2>;
  for (const Eigen::Vector3f& p : mesh.vertices)
    origin.seen_by.push_back(p.x() < 0.0F ? Seen{0, 2} : Seen{3, 8});
  for (const Eigen::Vector3f& p : mesh.vertices)
    mesh.colors.push_back({static_cast<std::uint8_t>(100.0F + 40.0F * p.x()), 40, 250});
  for (const Eigen::Vector3f& p : mesh.vertices)
    origin.mapped.emplace_back(p + Eigen::Vector3f::Constant(10.0F));
  return split_mesh(mesh, 1, 0, {.cell_m = 20.0}, &origin).chunks.at(0);
}

// Corners of a face with their labels and views, from the lowest corner on.
auto content_of(const MeshChunk& chunk, MeshChunk::Triple face) {
  const auto lowest =
      std::ranges::min_element(face, {}, [&](std::uint16_t v) { return chunk.offsets[v]; });
  std::ranges::rotate(face, lowest);
  std::vector<std::pair<MeshChunk::Triple, std::vector<int>>> corners;
  for (const std::uint16_t v : face)
    corners.push_back({chunk.offsets[v],
                       {chunk.labels[v], chunk.colors[v], chunk.views[v][0], chunk.views[v][1]}});
  return corners;
}

}  // namespace

TEST_CASE("A chunk is equal after packing and unpacking") {
  MeshChunk chunk = shuffled_chunk();
  SECTION("with all") {}
  SECTION("without labels") {
    chunk.labels.clear();
  }
  SECTION("without colours") {
    chunk.colors.clear();
  }
  SECTION("without views") {
    chunk.views.clear();
  }
  SECTION("with extreme numbers") {
    chunk.offsets = {{0, 65535, 32768}, {65535, 0, 0}, {32767, 65535, 1}};
    chunk.faces = {{65535, 0, 32768}, {0, 65535, 0}, {32767, 32768, 32767}};
    chunk.labels = {0, 255, 128};
    chunk.colors = {0, 65535, 0x8410};
    chunk.views = {{{0, 255}}, {{255, 0}}, {{127, 128}}};
  }
  SECTION("with random numbers") {
    std::mt19937 rng(2);
    for (auto& offset : chunk.offsets)
      for (std::uint16_t& number : offset) number = static_cast<std::uint16_t>(rng());
  }
  SECTION("without content") {
    chunk = {};
  }
  CHECK(unpacked(chunk) == chunk);
}

TEST_CASE("Sorting a chunk in space changes only the order of its vertices and faces") {
  const MeshChunk chunk = shuffled_chunk(), sorted = sorted_in_space(chunk);
  CHECK(fault_of(sorted) == nullptr);
  CHECK(counts_of(sorted).vertices == counts_of(chunk).vertices);
  const auto faces = [](const MeshChunk& of) {
    std::set<std::vector<std::pair<MeshChunk::Triple, std::vector<int>>>> contents;
    for (const MeshChunk::Triple& face : of.faces) contents.insert(content_of(of, face));
    return contents;
  };
  CHECK(faces(sorted) == faces(chunk));
  CHECK(faces(sorted).size() == chunk.faces.size());
  CHECK(sorted_in_space(sorted) == sorted);
}

TEST_CASE("A sorted and packed chunk takes less than a third of its bytes") {
  const MeshChunk chunk = shuffled_chunk();
  CHECK(3 * packed(sorted_in_space(chunk)).size() < plain_bytes(chunk));
  CHECK(packed(sorted_in_space(chunk)).size() < packed(chunk).size());
  CHECK(wire_bytes(chunk) >= packed(chunk).size() + kMeshKeyframeBytes * chunk.keyframes.size());
}

}  // namespace km
