#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>

#include "modules/view/node/view_channel_codec.hpp"
#include "modules/view/view_incumbents.hpp"
#include "modules/view/view_update.hpp"
#include "runtime/dds/participant.hpp"

namespace km {

/// Viewer of a team: a participant of its DDS domain that writes nothing, so that robots do not
/// treat it as a robot. It receives the updates for viewers. If several processes send updates with
/// one robot id, ViewIncumbents chooses the one that counts.
class ViewListener {
 public:
  /// Joins the domain. Throws ConfigError for an unusable `config`, DdsError if DDS refuses it.
  explicit ViewListener(DdsConfig config);
  /// Uses a domain that it shares with robots of this process (tests).
  explicit ViewListener(std::shared_ptr<const DdsDomain> domain);

  /// Waits for an update; nullopt after `patience_s` without one, and after stop(). Only one thread
  /// calls this.
  [[nodiscard]] std::optional<ViewUpdate> next(double patience_s);

  /// Requests the images of these robots and of no others from now on. Thread-safe.
  void ask_for_images(const std::set<RobotId>& robots);

  /// Number of invalid updates: another program writes on these topics. Thread-safe.
  [[nodiscard]] std::uint64_t refused() const { return refused_; }

  [[nodiscard]] const NetworkInterface& interface() const { return domain_->interface(); }

  /// Ends a present or later next(). Thread-safe.
  void stop() noexcept;

 private:
  void take_all();
  void follow_requests();

  std::shared_ptr<const DdsDomain> domain_;  // Outlives the members below.
  DdsEntity participant_, image_topic_, view_topic_, mesh_topic_;
  DdsEntity wake_;  // Guard condition that is triggered by stop() and by new requests.
  ViewReader view_, mesh_;
  std::map<RobotId, ViewReader> images_;
  DdsEntity waitset_;
  ViewIncumbents incumbents_;
  std::deque<ViewUpdate> taken_;
  std::mutex mutex_;         // Guards asked_.
  std::set<RobotId> asked_;  // Robots whose images are requested.
  std::atomic<bool> stopped_ = false;
  std::atomic<std::uint64_t> refused_ = 0;
};

}  // namespace km
