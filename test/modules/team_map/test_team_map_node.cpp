#include <catch2/catch.hpp>

#include <memory>

#include "modules/mesh/node/mesh_chunks_node.hpp"
#include "modules/mesh/node/mesh_codec.hpp"
#include "modules/team_map/node/team_map_node.hpp"
#include "test/modules/mesh/wavy_sheet.hpp"
#include "test/runtime/dds/dds_fixture.hpp"

namespace km {
namespace {

constexpr double kNodeVoxel_m = 0.1;

MapSharingConfig fast() {
  MapSharingConfig config;
  config.max_bytes_per_s = 2e6;
  return config;
}

// A robot that shares its mesh and fuses those of all.
struct Mapper {
  Mapper(const std::shared_ptr<const DdsDomain>& domain, RobotId robot)
      : basis(domain, robot),
        sender(fast(), robot, sent),
        map(kNodeVoxel_m, {}, sent, chunks.from_peers()) {
    basis.bridge.exchange(chunks, TopicKind::kState, TrafficCategory::kOther);
    sent.subscribe([this](const auto& chunk) { chunks.to_peers().publish(chunk); });
    map.start();
    basis.start();
    sender.start();
  }
  ~Mapper() {
    sender.stop();
    basis.stop();
    map.stop();
  }
  void offer(float height_m) {
    LabelledMesh mesh = wavy_sheet(60, 0.1);
    for (Eigen::Vector3f& p : mesh.vertices) p.z() += height_m;
    sender.offer(0, std::make_shared<const LabelledMesh>(std::move(mesh)));
  }

  Topic<MeshChunk> sent;
  Crossing<MeshChunk> chunks;
  TestRobot basis;
  MeshChunksNode sender;
  TeamMapNode map;
};

bool have_one_map(Mapper& a, Mapper& b) {
  return eventually([&] {
    const LabelledMesh of_a = a.map.fuse().mesh, of_b = b.map.fuse().mesh;
    return !of_a.empty() && of_a.vertices == of_b.vertices && of_a.faces == of_b.faces &&
           of_a.labels == of_b.labels;
  });
}

}  // namespace

TEST_CASE("Robots have the same map of their team, also those that join later", "[node][dds]") {
  const auto domain = std::make_shared<const DdsDomain>(loopback_config());
  Mapper a(domain, 3), b(domain, 4);
  REQUIRE(b.basis.receives(PeerEventKind::kJoined, 3));
  a.offer(0.0F);
  b.offer(0.05F);
  REQUIRE(eventually([&] { return a.sender.is_done() && b.sender.is_done(); }));
  CHECK(have_one_map(a, b));
  const std::size_t faces = a.map.fuse().mesh.faces.size();
  a.offer(0.02F);  // bent
  b.offer(0.03F);
  Mapper late(domain, 5);
  CHECK(have_one_map(a, b));
  CHECK(have_one_map(a, late));
  CHECK(late.map.fuse().mesh.faces.size() == Approx(static_cast<double>(faces)).epsilon(0.05));
}

}  // namespace km
