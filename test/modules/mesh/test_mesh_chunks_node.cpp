#include "modules/core/geometry/lie.hpp"
#include "modules/mesh/chunk_packing.hpp"
#include "modules/mesh/mesh_chunks.hpp"
#include "modules/mesh/node/mesh_chunks_node.hpp"
#include "modules/mesh/node/mesh_codec.hpp"
#include "runtime/dds/envelope.hpp"
#include "test/modules/mesh/assembled_mesh.hpp"
#include "test/modules/mesh/wavy_sheet.hpp"
#include "test/runtime/dds/dds_fixture.hpp"
#include "test/support/corrupted_message.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr RobotId kAnchor = 3;

std::shared_ptr<const LabelledMesh> sheet(std::uint32_t side) {
  return std::make_shared<const LabelledMesh>(wavy_sheet(side, 0.1));
}

std::shared_ptr<const LabelledMesh> raised(const LabelledMesh& mesh, float height_m) {
  LabelledMesh result = mesh;
  for (auto& vertex : result.vertices) vertex.z() += height_m;
  return std::make_shared<const LabelledMesh>(std::move(result));
}

// The chunks that a MeshChunksNode sends.
std::vector<MeshChunk> chunks_of(const LabelledMesh& mesh, RobotId robot) {
  std::vector<MeshChunk> chunks = split_mesh(mesh, robot, kAnchor, {}).chunks;
  for (MeshChunk& chunk : chunks) chunk = sorted_in_space(chunk);
  return chunks;
}

std::size_t bytes_of(const std::vector<MeshChunk>& chunks) {
  std::size_t bytes = 0;
  for (const MeshChunk& chunk : chunks) bytes += wire_bytes(chunk);
  return bytes;
}

// Messages of a MeshChunksNode.
struct SentMesh {
  Topic<MeshChunk> chunk_topic;
  Topic<MeshPoses> poses_topic;
  Inbox<MeshChunk> chunks{chunk_topic};
  Inbox<MeshPoses> poses{poses_topic};
  [[nodiscard]] MeshChunksTopics topics() { return {chunk_topic, poses_topic}; }
};

MapSharingConfig slow() {
  MapSharingConfig config{.max_bytes_per_s = 20000.0};
  return config;
}

TEST_CASE("Chunks are sent no faster than configured") {
  SentMesh out;
  Inbox<MeshChunk>& sent = out.chunks;
  MeshChunksNode node(slow(), 7, out.topics());
  const auto mesh = sheet(150);
  const std::size_t all = chunks_of(*mesh, 7).size();
  node.step({kAnchor, mesh}, 1000.0);
  double now_s = 1000.0;
  const auto within_bounds = [&] {
    // Half a second's budget, and one chunk of overdraft.
    const double most = (now_s - 1000.0 + 0.5) * 20000.0 + static_cast<double>(kMaxChunkBytes);
    return static_cast<double>(bytes_of(sent.messages())) <= most;
  };
  CHECK(within_bounds());
  CHECK(node.waiting() > 0);
  for (; node.waiting() > 0 && now_s < 2000.0; now_s += 0.1) {
    node.step({}, now_s);
    REQUIRE(within_bounds());
  }
  CHECK(sent.messages().size() == all);
  const double least_s =
      (static_cast<double>(bytes_of(sent.messages())) - kMaxChunkBytes) / 20000.0;
  CHECK(now_s - 1000.0 > least_s - 0.5);
  CHECK(now_s - 1000.0 < least_s + 3.0);  // and no slower
}

TEST_CASE("A mesh that changes while it is sent ends in its newest state") {
  SentMesh out;
  Inbox<MeshChunk>& sent = out.chunks;
  MeshChunksNode node(slow(), 7, out.topics());
  const auto mesh = sheet(100);
  node.step({kAnchor, mesh}, 0.0);
  const std::size_t early = sent.messages().size();
  // Later than the pause after a mesh, which depends on the time that it took.
  node.step({kAnchor, raised(*mesh, 0.5F)}, 1000.0);
  for (double now_s = 1000.1; node.waiting() > 0 && now_s < 2000.0; now_s += 0.1)
    node.step({}, now_s);
  const std::size_t all = chunks_of(*raised(*mesh, 0.5F), 7).size();
  CHECK(sent.messages().size() <= all + 2 * early);  // those sent before, again, or as empty

  TeamMesh team;
  for (const MeshChunk& chunk : sent.messages()) REQUIRE(team.add(chunk) == ChunkVerdict::kTaken);
  const LabelledMesh received = assembled(team, 7);
  CHECK(received.vertices.size() == mesh->vertices.size());
  float lowest = 10.0F;
  for (const auto& vertex : received.vertices) lowest = std::min(lowest, vertex.z());
  CHECK(lowest == Approx(-0.5F).margin(0.01));
}

// A sheet of 3 m whose left half was seen by keyframes 0 to 2 and the right one by 12.
struct TwoViews {
  TwoViews() : mesh(sheet(30)) {
    for (std::uint32_t i = 0; i < 13; ++i)
      origin.T_world_kf.push_back(make_pose(Eigen::Matrix3d::Identity(), {2.0 * i, 0, 0}));
    origin.mapped = mesh->vertices;
    for (const auto& vertex : mesh->vertices)
      origin.seen_by.push_back(vertex.x() < 0.0F ? std::array<KeyframeIndex, 2>{0, 2}
                                                 : std::array<KeyframeIndex, 2>{12, 12});
  }
  [[nodiscard]] MeshOffer offer() const {
    return {kAnchor, mesh, std::make_shared<const MeshOrigin>(origin)};
  }
  std::shared_ptr<const LabelledMesh> mesh;
  MeshOrigin origin;
};

TEST_CASE("Poses take at most a tenth of the bytes, and the newest are sent last") {
  SentMesh out;
  MapSharingConfig config{.max_bytes_per_s = 1000.0};
  MeshChunksNode node(config, 7, out.topics());
  TwoViews views;
  double now_s = 0.0;
  for (int i = 0; i < 300; ++i) {
    for (SE3& pose : views.origin.T_world_kf) pose.translation().z() += 0.1;
    views.mesh = raised(*views.mesh, 0.1F);
    node.step(views.offer(), now_s += 1.0);
  }
  const std::vector<MeshPoses> sent = out.poses.messages();
  CHECK(static_cast<double>(sent.size() * wire_bytes(sent.front())) < 0.1 * 1000.0 * 302.0);
  CHECK(sent.size() > 50);
  for (int i = 0; i < 100; ++i) node.step({}, now_s += 10.0);
  CHECK(node.waiting() == 0);
  CHECK(out.poses.messages().back().keyframes == mesh_keyframes(views.origin.T_world_kf));
}

MeshChunk some_chunk() {
  return split_mesh(wavy_sheet(20, 0.1), 700, 3, {}).chunks.at(1);
}

// States 5 keyframes, all vertices seen from the first to the last.
void state_keyframes(MeshChunk& chunk) {
  chunk.keyframes = mesh_keyframes(
      std::vector<SE3>(20, make_pose(so3_exp({0.1, 0.2, 0.3}), {1.5, -2.25, 300.0})));
  chunk.views.assign(chunk.offsets.size(), {0, 16});
}

Arrived<MeshChunk> received(const MeshChunk& chunk) {
  return encoded_by(TeamPeer{chunk.key.robot, 12345}, chunk);
}

TEST_CASE("A mesh chunk is equal after encoding and decoding") {
  MeshChunk chunk = some_chunk();
  SECTION("with labels") {}
  SECTION("without labels") {
    chunk.labels.clear();
  }
  SECTION("empty because the piece has vanished") {
    chunk = {.key = chunk.key};
  }
  SECTION("with keyframes") {
    state_keyframes(chunk);
  }
  SECTION("far away") {
    chunk.origin = {-(1 << 30), 1 << 30, 0};
  }
  const auto encoded = received(chunk);
  const Decoded<MeshChunk> result = decoded(encoded);
  REQUIRE(result.value);
  chunk.boot = 12345;
  CHECK(*result.value == chunk);
}

TEST_CASE("The largest chunk is equal after encoding and decoding") {
  const LabelledMesh mesh = wavy_sheet(180, 0.01);
  MeshOrigin origin{.seen_by = {}, .T_world_kf = {}, .mapped = mesh.vertices};
  origin.T_world_kf.assign(2000, SE3::Identity());
  for (KeyframeIndex v = 0; v < mesh.vertices.size(); ++v)
    origin.seen_by.push_back({4 * v % 252, 4 * v % 252});
  const SplitMesh pieces = split_mesh(mesh, 1, 1, {}, &origin);
  std::size_t largest = 0;
  for (const MeshChunk& chunk : pieces.chunks) {
    CHECK(chunk.keyframes.size() <= 63);
    largest = std::max(largest, plain_bytes(chunk));
    CHECK(decoded(received(chunk)).value);
  }
  CHECK(largest > kMaxChunkBytes - 75);  // room for another keyframe and for half a face
  CHECK(largest <= kMaxChunkBytes);
}

TEST_CASE("An impossible mesh chunk is refused") {
  MeshChunk chunk = some_chunk();
  state_keyframes(chunk);
  const char* const missing = "elements are missing or too many";
  const char* const unpacked = "a chunk that cannot be unpacked";
  const char* const far = "positions are not finite or too far away";
  const auto changed = [&chunk](const std::function<void(MeshChunk&)>& change) {
    return [&chunk, change](auto& m) {
      MeshChunk other = chunk;
      change(other);
      m = received(other);
    };
  };
  check_refusals<MeshChunk>(
      [&] { return received(chunk); },
      {{"content not there", missing, [](auto& m) { m.wire.content._buffer = nullptr; }},
       {"content without end", missing, [](auto& m) { m.wire.content._length = 0xffffffffU; }},
       {"content without its end", unpacked, [](auto& m) { --m.wire.content._length; }},
       {"no content", unpacked, [](auto& m) { m.wire.content._length = 0; }},
       {"damaged content", unpacked, [](auto& m) { m.content[0] ^= 1U; }},
       {"a vertex too few", unpacked, [](auto& m) { --m.wire.vertices; }},
       {"a face too many", unpacked, [](auto& m) { ++m.wire.faces; }},
       {"content that is not empty for no vertices", unpacked,
        [](auto& m) { m.wire.vertices = m.wire.faces = 0; }},
       {"labels that are not stated", unpacked, [](auto& m) { m.wire.is_labelled = false; }},
       {"views of no keyframes", unpacked, [](auto& m) { m.wire.keyframes._length = 0; }},
       {"more content than a chunk has", unpacked, changed([](MeshChunk& large) {
          large.faces.resize(6000, {0, 1, 2});
        })},
       {"too large", "a chunk that is too large", changed([](MeshChunk& large) {
          large.faces.resize((kMaxChunkBytes - 10 * large.offsets.size()) / 6, {0, 1, 2});
        })},
       {"keyframes not there", missing, [](auto& m) { m.wire.keyframes._buffer = nullptr; }},
       {"keyframes without end", missing, [](auto& m) { m.wire.keyframes._length = 65; }},
       {"a view after the last keyframe", "a view between keyframes which do not exist",
        changed([](MeshChunk& late) { late.views.back()[1] = 17; })},
       {"a view of a keyframe outside", "a view between keyframes which do not exist",
        changed([](MeshChunk& late) { late.views.back()[1] = 255; })},
       {"a keyframe twice", "keyframes do not ascend",
        [](auto& m) { m.keyframes[1].keyframe = 0; }},
       {"no rotation", "a keyframe without a rotation",
        [](auto& m) { std::ranges::fill(m.keyframes[1].q, std::int16_t{0}); }},
       {"a face outside", "a face names a vertex which does not exist",
        changed([](MeshChunk& outside) {
          outside.faces.back()[2] = static_cast<std::uint16_t>(outside.offsets.size());
        })},
       {"vertices for nothing", "vertices without faces",
        changed([](MeshChunk& empty) { empty.faces.clear(); })},
       {"steps that are no number", far,
        [](auto& m) { m.wire.step_m = std::numeric_limits<float>::quiet_NaN(); }},
       {"no steps", far, [](auto& m) { m.wire.step_m = 0.0F; }},
       {"endless steps", far,
        [](auto& m) { m.wire.step_m = std::numeric_limits<float>::infinity(); }},
       {"steps of light years", far, [](auto& m) { m.wire.step_m = 1e16F; }},
       {"an origin at the end of all numbers", far,
        [](auto& m) { m.wire.origin.y = std::numeric_limits<std::int32_t>::min(); }}});
}

TEST_CASE("Poses of a mesh are equal after encoding and decoding") {
  MeshPoses poses{.robot = 700, .anchor = 3};
  poses.keyframes = mesh_keyframes(
      std::vector<SE3>(GENERATE(0U, 1U, 4096U), make_pose(so3_exp({0.1, 2.0, 0.3}), {-1e6, 2, 3})));
  const auto encoded = encoded_by(TeamPeer{700, 12345}, poses);
  CHECK(serialize(Codec<MeshPoses>::descriptor(), &encoded.wire).size() <=
        Codec<MeshPoses>::kMaxBytes);
  const Decoded<MeshPoses> result = decoded(encoded);
  REQUIRE(result.value);
  poses.boot = 12345;
  CHECK(*result.value == poses);
}

TEST_CASE("Impossible poses of a mesh are refused") {
  const MeshPoses poses{.keyframes = mesh_keyframes(std::vector<SE3>(20, SE3::Identity()))};
  const char* const missing = "elements are missing or too many";
  check_refusals<MeshPoses>(
      [&] { return encoded_by(RobotId{1}, poses); },
      {{"keyframes not there", missing, [](auto& m) { m.wire.keyframes._buffer = nullptr; }},
       {"too many keyframes", missing, [](auto& m) { m.wire.keyframes._length = 1025; }},
       {"keyframes without end", missing, [](auto& m) { m.wire.keyframes._length = 0xffffffffU; }},
       {"keyframes in disorder", "keyframes do not ascend",
        [](auto& m) { m.keyframes[2].keyframe = 1; }},
       {"a rotation that is none", "a keyframe without a rotation",
        [](auto& m) { std::ranges::fill(m.keyframes[3].q, std::int16_t{32767}); }}});
}

}  // namespace
}  // namespace km
