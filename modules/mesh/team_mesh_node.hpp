#pragma once

#include <exception>
#include <mutex>
#include <string_view>
#include <vector>

#include "modules/mesh/team_mesh.hpp"
#include "runtime/node.hpp"
#include "runtime/topic.hpp"
#include "runtime/worker.hpp"

namespace km {

/// Holds the meshes that other robots send.
class TeamMeshNode final : public Node {
 public:
  /// `chunks`: received ones.
  explicit TeamMeshNode(In<MeshChunk> chunks);
  ~TeamMeshNode() override { stop(); }

  /// Meshes as far as they have arrived, by robot. Takes time in proportion. Thread-safe.
  [[nodiscard]] std::vector<RobotMesh> snapshot() const;

  std::string_view name() const override { return "team_mesh"; }
  void start() override { worker_.start(); }
  void stop() noexcept override { worker_.stop(); }
  std::exception_ptr error() const override { return worker_.error(); }
  DurationHistogram timing() const override { return worker_.timing(); }

 private:
  void take(const MeshChunk& chunk);

  mutable std::mutex mutex_;  // guards team_
  TeamMesh team_;
  Worker<Topic<MeshChunk>::Message> worker_;  // last member: stops first
};

}  // namespace km
