#pragma once

#include <cstddef>
#include <functional>

#include "modules/core/ids.hpp"
#include "modules/core/robot_identity.hpp"
#include "modules/view/view_update.hpp"
#include "runtime/dds/entity.hpp"

namespace km {

/// DDS topics on which robots send their state to viewers. All are reliable, keep only the last
/// update for late readers, and drop data for slow readers so that no writer waits for them.
enum class ViewChannel {
  kView,    ///< All small updates.
  kMesh,    ///< The map: chunks of the mesh, objects, rasters.
  kImages,  ///< The newest image. Its DDS partition is the robot's id, so subscribing requests the
            ///< images.
};

/// Channel that carries this kind of content.
[[nodiscard]] ViewChannel channel_of(const ViewContent& content);

[[nodiscard]] DdsEntity create_view_topic(dds_entity_t participant, ViewChannel channel);

/// Writes one robot's updates. Not thread-safe.
class ViewWriter {
 public:
  /// `participant` outlives this.
  ViewWriter(dds_entity_t participant, ViewChannel channel, const TeamPeer& self);

  /// Number of matched readers. Readers of a viewer that died count until its lease is over.
  [[nodiscard]] std::size_t readers() const;
  /// Number of readers that have appeared since the last call.
  [[nodiscard]] std::size_t newcomers();

  /// Writes an update and returns its bytes, counted once for all readers. Throws DdsError, and the
  /// exceptions of encode_view().
  std::size_t write(const ViewContent& content);

  /// Waits until all readers have acknowledged all updates; false after `timeout_s`.
  bool await_readers(double timeout_s) const;

 private:
  [[nodiscard]] dds_publication_matched_status_t matched() const;

  ViewChannel channel_;
  TeamPeer self_;
  DdsEntity topic_, publisher_, writer_;
  std::size_t come_ = 0;  // Number of readers that have appeared.
};

/// Reads the updates of robots on one channel. Not thread-safe.
class ViewReader {
 public:
  /// `of` selects the robot whose images are read; other channels ignore it. `participant` and
  /// `topic` outlive this.
  ViewReader(dds_entity_t participant, dds_entity_t topic, ViewChannel channel, RobotId of = 0);

  [[nodiscard]] dds_entity_t handle() const { return reader_.handle(); }

  /// Passes each update that has arrived to `take_one`. Returns the number of invalid updates,
  /// which are dropped.
  std::size_t take(const std::function<void(ViewUpdate)>& take_one);

 private:
  ViewChannel channel_;
  DdsEntity subscriber_, reader_;
};

}  // namespace km
