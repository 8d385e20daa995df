#include <catch2/catch.hpp>

#include <optional>
#include <string>

#include "apps/lab/pgo/scenario.hpp"
#include "apps/lab/pgo/team_graph_file.hpp"
#include "test/support/eavesdropper.hpp"
#include "test/support/shared_data.hpp"

namespace km {
namespace {

std::optional<TeamGraph> recorded(const std::string& name, std::size_t robots) {
  const auto path = shared_data(name);
  if (!path) return std::nullopt;
  if (robots == 0) return read_team_folder(*path);
  return partition_contiguously(read_g2o(*path), robots, name);
}

struct Recorded {
  const char* name;
  std::size_t robots;  // 0: those of the recording
};

const auto kGraphs = {
    Recorded{"pose_graphs/3d/sphere2500.g2o", 5}, Recorded{"pose_graphs/3d/torus3D.g2o", 5},
    Recorded{"pose_graphs/2d/city10000.g2o", 5}, Recorded{"multi_robot/tunnels_8robots", 0}};
// Enough for several updates of the weights. Second derivatives are sent in the first of them.
constexpr int kRounds = 12;

TEST_CASE("No private pose can be derived from the poses and edges that robots send",
          "[pgo][slow]") {
  const auto [name, robots] = GENERATE(values(kGraphs));
  CAPTURE(name);
  const auto clean = recorded(name, robots);
  if (!clean) return;
  const TeamGraph graph =
      robots == 0 ? *clean : corrupt(*clean, clean->edges.size() / 10, 5.0, 4);  // to be weighed
  Eavesdropper ear = listen_to(graph, kRounds);
  // The eavesdropper has received all messages.
  CHECK(ear.messages() >= static_cast<std::size_t>(kRounds) * 2 * (graph.robots() - 1) - 2);
  CHECK(ear.announced_poses() >= graph.robots());
  CHECK(ear.private_poses() > 0);
  CHECK(ear.misfits() == 0);
  CHECK(ear.named_private().empty());
  CHECK(ear.derivable().empty());
  WARN(name << ": of " << ear.private_poses() << " private poses " << ear.derivable().size()
            << " can be chained; " << ear.public_poses().size() << " public, " << ear.sent_edges()
            << " sent edges, " << ear.bytes() << " bytes");
}

}  // namespace
}  // namespace km
