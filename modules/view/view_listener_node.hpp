#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>

#include "modules/view/view_channel_codec.hpp"
#include "modules/view/view_incumbents.hpp"
#include "modules/view/view_update.hpp"
#include "runtime/dds/participant.hpp"

namespace km {

/// One who watches a team: a participant of its DDS domain that says nothing, so that robots do not
/// take it for one of them. It hears what they tell those who watch; where two tell as one robot,
/// the first, see ViewIncumbents.
class ViewListener {
 public:
  /// Joins the domain. Throws ConfigError for an unusable `config`, DdsError if DDS refuses it.
  explicit ViewListener(DdsConfig config);
  /// In a domain that it shares with robots of this process (tests).
  explicit ViewListener(std::shared_ptr<const DdsDomain> domain);

  /// Waits for an update; nullopt if none comes for so long [s], and after stop(). One thread calls
  /// this.
  [[nodiscard]] std::optional<ViewUpdate> next(double patience_s);

  /// From now on the images of these robots, and no others, are asked for. Thread-safe.
  void ask_for_images(const std::set<RobotId>& robots);

  /// Updates that were none: somebody else writes on these topics. Thread-safe.
  [[nodiscard]] std::uint64_t refused() const { return refused_; }

  [[nodiscard]] const NetworkInterface& interface() const { return domain_->interface(); }

  /// Ends next(), now and later. Thread-safe.
  void stop() noexcept;

 private:
  void take_all();
  void follow_requests();

  std::shared_ptr<const DdsDomain> domain_;  // outlives what follows
  DdsEntity participant_, image_topic_, view_topic_, mesh_topic_;
  DdsEntity wake_;  // guard condition: to stop, or robots to ask
  ViewReader view_, mesh_;
  std::map<RobotId, ViewReader> images_;
  DdsEntity waitset_;
  ViewIncumbents incumbents_;
  std::deque<ViewUpdate> taken_;
  std::mutex mutex_;         // guards asked_
  std::set<RobotId> asked_;  // for images
  std::atomic<bool> stopped_ = false;
  std::atomic<std::uint64_t> refused_ = 0;
};

}  // namespace km
