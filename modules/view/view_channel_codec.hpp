#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "modules/core/ids.hpp"
#include "modules/core/robot_identity.hpp"
#include "modules/view/view_update.hpp"
#include "runtime/dds/entity.hpp"

namespace km {

/// The DDS topics on which robots tell those who watch. All are reliable, keep no past but the last
/// update, and so little for slow readers that no writer waits for them.
enum class ViewChannel {
  kView,    ///< All that is small.
  kMesh,    ///< Pieces of the mesh.
  kImages,  ///< The newest image. In the partition of its robot's id: to read it is to ask for it.
};

/// What goes over which.
[[nodiscard]] ViewChannel channel_of(const ViewContent& content);

[[nodiscard]] DdsEntity create_view_topic(dds_entity_t participant, ViewChannel channel);

/// Writes one robot's updates. Not thread-safe.
class ViewWriter {
 public:
  /// `participant` outlives it.
  ViewWriter(dds_entity_t participant, ViewChannel channel, const TeamPeer& self);

  /// Readers that are there. Those of a viewer that died are there until its lease is over.
  [[nodiscard]] std::size_t readers() const;
  /// Readers that have come since the last call.
  [[nodiscard]] std::size_t newcomers();

  /// Tells it now; bytes that were written, each once, however many read them. Throws DdsError,
  /// and what encode_view() throws.
  std::size_t write(const ViewContent& content);

  /// Waits until everybody has everything; false if that takes longer.
  bool await_readers(double timeout_s) const;

 private:
  [[nodiscard]] dds_publication_matched_status_t matched() const;

  ViewChannel channel_;
  TeamPeer self_;
  DdsEntity topic_, publisher_, writer_;
  std::size_t come_ = 0;  // since the beginning
};

/// Reads what robots write on one channel. Not thread-safe.
class ViewReader {
 public:
  /// Of kImages: those of the robot `of`. `participant` and `topic` outlive it.
  ViewReader(dds_entity_t participant, dds_entity_t topic, ViewChannel channel, RobotId of = 0);

  [[nodiscard]] dds_entity_t handle() const { return reader_.handle(); }

  /// Hands each update that has arrived to `take`; how many were refused: what robots do not write.
  template <typename Take>
  std::size_t take(const Take& take_one) {
    std::size_t refused = 0;
    while (auto batch = take_batch()) {
      refused += batch->refused;
      for (ViewUpdate& update : batch->updates) take_one(std::move(update));
    }
    return refused;
  }

 private:
  struct Batch {
    std::vector<ViewUpdate> updates;
    std::size_t refused = 0;
  };
  [[nodiscard]] std::optional<Batch> take_batch();

  ViewChannel channel_;
  DdsEntity subscriber_, reader_;
};

}  // namespace km
