#pragma once

#include <atomic>
#include <exception>
#include <memory>
#include <mutex>
#include <string_view>
#include <vector>

#include "modules/mesh/chunk_schedule.hpp"
#include "modules/mesh/labelled_mesh.hpp"
#include "modules/mesh/mesh_chunks_config.hpp"
#include "modules/mesh/team_mesh.hpp"
#include "runtime/node.hpp"
#include "runtime/periodic.hpp"
#include "runtime/token_bucket.hpp"
#include "runtime/topic.hpp"
#include "runtime/worker.hpp"

namespace km {

/// Publishes the robot's mesh in chunks, at most max_bytes_per_s on average. Only chunks that have
/// changed since they were last sent are sent, each in its newest version. The module that has the
/// robot's best mesh passes it to offer().
class MeshChunksNode final : public Node {
 public:
  /// A mesh in the frame `world` of the robot `anchor`; a null mesh is a tick of the clock.
  struct Offer {
    RobotId anchor = 0;
    std::shared_ptr<const LabelledMesh> mesh;
  };

  /// Throws ConfigError if `config` is out of bounds. `chunks` are published to the peers.
  MeshChunksNode(const MeshChunksConfig& config, RobotId self, Out<MeshChunk> chunks);
  ~MeshChunksNode() override { stop(); }

  /// Only the newest mesh counts. Thread-safe; returns at once.
  void offer(RobotId anchor, std::shared_ptr<const LabelledMesh> mesh);

  std::string_view name() const override { return MeshChunksConfig::kSection; }
  void start() override;
  void stop() noexcept override;  ///< Drops the chunks that have not been sent.
  std::exception_ptr error() const override;
  std::vector<Heartbeat*> heartbeats() override { return {&worker_.heartbeat()}; }
  DurationHistogram timing() const override { return worker_.timing(); }

  /// Number of waiting chunks. Thread-safe.
  [[nodiscard]] std::size_t waiting() const { return waiting_; }

  /// Handles one offer synchronously at time `now_s`. The thread calls only this function; tests
  /// can call it too.
  void step(const Offer& offer, double now_s);

 private:
  void take(const Offer& offer);
  void send(double now_s);

  const MeshChunksConfig config_;
  const RobotId self_;
  const Out<MeshChunk> chunks_;
  ChunkSchedule schedule_;
  TokenBucket budget_bytes_;
  std::atomic<std::size_t> waiting_ = 0;
  Worker<Offer> worker_;
  Periodic ticks_;  // last member: stops before the worker it posts to
};

/// Stores the meshes that other robots send.
class TeamMeshNode final : public Node {
 public:
  /// `chunks`: received chunks.
  explicit TeamMeshNode(In<MeshChunk> chunks);
  ~TeamMeshNode() override { stop(); }

  /// The received parts of all meshes, by robot. Time proportional to their size. Thread-safe.
  [[nodiscard]] std::vector<RobotMesh> snapshot() const;

  std::string_view name() const override { return "team_mesh"; }
  void start() override { worker_.start(); }
  void stop() noexcept override { worker_.stop(); }
  std::exception_ptr error() const override { return worker_.error(); }
  std::vector<Heartbeat*> heartbeats() override { return {&worker_.heartbeat()}; }
  DurationHistogram timing() const override { return worker_.timing(); }

 private:
  void take(const MeshChunk& chunk);

  mutable std::mutex mutex_;  // guards team_
  TeamMesh team_;
  Worker<Topic<MeshChunk>::Message> worker_;  // last member: stops first
};

}  // namespace km
