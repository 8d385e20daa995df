#include "modules/mesh/node/mesh_chunks_node.hpp"
#include "modules/mesh/node/mesh_codec.hpp"
#include "modules/team_map/node/team_map_node.hpp"
#include "test/modules/mesh/wavy_sheet.hpp"
#include "test/runtime/dds/dds_fixture.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

MapSharingConfig fast() {
  MapSharingConfig config{.max_bytes_per_s = 2e6};
  return config;
}

// A robot that shares its mesh and fuses those of all.
struct Mapper {
  Mapper(const std::shared_ptr<const DdsDomain>& domain, RobotId robot)
      : basis(domain, robot),
        sender(fast(), robot, {sent, sent_poses}),
        map({}, {.own_chunks = sent,
                 .received_chunks = chunks.from_peers(),
                 .own_poses = sent_poses,
                 .received_poses = poses.from_peers()}) {
    basis.bridge.exchange(chunks, TopicKind::kState, TrafficCategory::kMap);
    basis.bridge.exchange(poses, TopicKind::kState, TrafficCategory::kMap);
    sent.subscribe([this](const auto& chunk) { chunks.to_peers().publish(chunk); });
    sent_poses.subscribe([this](const auto& newest) { poses.to_peers().publish(newest); });
    map.start();
    basis.start();
    sender.start();
  }
  ~Mapper() {
    sender.stop();
    basis.stop();
    map.stop();
  }
  // A sheet of 6 m that three keyframes saw. Its right half is `bend_m` higher than the left one,
  // and so are the keyframes that saw it.
  void offer(float height_m, float bend_m) {
    LabelledMesh mesh = wavy_sheet(60, 0.1);
    MeshOrigin origin{.seen_by = {}, .T_world_kf = {}, .mapped = mesh.vertices};
    for (int i = 0; i < 9; ++i)
      origin.T_world_kf.push_back(
          make_pose(Eigen::Matrix3d::Identity(), {0.0, 0.0, i < 4 ? 1.0 : 1.0 + bend_m}));
    for (Eigen::Vector3f& p : mesh.vertices) {
      origin.seen_by.push_back(p.x() < 0.0F ? std::array<KeyframeIndex, 2>{0, 0}
                                            : std::array<KeyframeIndex, 2>{4, 8});
      p.z() += height_m + (p.x() < 0.0F ? 0.0F : bend_m);
    }
    sender.offer(0, std::make_shared<const LabelledMesh>(std::move(mesh)),
                 std::make_shared<const MeshOrigin>(std::move(origin)));
  }
  [[nodiscard]] std::uint64_t sent_chunk_bytes() {
    for (const TopicTraffic& row : basis.bridge.traffic().topics)
      if (row.topic == Codec<MeshChunk>::kTopic && row.direction == Direction::kOut)
        return row.count.bytes;
    return 0;
  }

  Topic<MeshChunk> sent;
  Topic<MeshPoses> sent_poses;
  Crossing<MeshChunk> chunks;
  Crossing<MeshPoses> poses;
  TestRobot basis;
  MeshChunksNode sender;
  TeamMapNode map;
};

float height_of(const LabelledMesh& mesh) {
  float highest = 0.0F;
  for (const Eigen::Vector3f& p : mesh.vertices) highest = std::max(highest, p.z());
  return highest;
}

bool have_one_map(Mapper& a, Mapper& b) {
  return eventually([&] {
    const LabelledMesh of_a = a.map.fuse().mesh, of_b = b.map.fuse().mesh;
    return !of_a.empty() && of_a.vertices == of_b.vertices && of_a.faces == of_b.faces &&
           of_a.labels == of_b.labels;
  });
}

}  // namespace

TEST_CASE("Robots have the same map of their team, also those that join later") {
  const auto domain = std::make_shared<const DdsDomain>(loopback_config());
  Mapper a(domain, 3), b(domain, 4);
  REQUIRE(b.basis.receives(PeerEventKind::kJoined, 3));
  a.offer(0.0F, 0.0F);
  b.offer(0.05F, 0.0F);
  REQUIRE(eventually([&] { return a.sender.is_done() && b.sender.is_done(); }));
  CHECK(have_one_map(a, b));
  const std::uint64_t sent = a.sent_chunk_bytes();
  CHECK(sent > 10'000);
  a.offer(0.0F, 1.0F);  // corrected
  REQUIRE(eventually([&] { return height_of(a.map.fuse().mesh) > 1.5F; }));
  CHECK(have_one_map(a, b));
  CHECK(a.sent_chunk_bytes() == sent);
  b.offer(0.03F, 1.0F);  // corrected, and mapped again at another height
  Mapper late(domain, 5);
  CHECK(have_one_map(a, b));
  CHECK(have_one_map(a, late));
  CHECK(height_of(late.map.fuse().mesh) > 1.5F);
}

}  // namespace km
