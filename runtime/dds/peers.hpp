#pragma once

#include <deque>
#include <mutex>
#include <optional>
#include <vector>

#include "runtime/dds/entity.hpp"
#include "runtime/dds/participant.hpp"
#include "runtime/dds/peer_table.hpp"
#include "runtime/topic.hpp"

namespace km {

/// Feeds a PeerTable from DDS discovery and from the liveliness of the status topic, and logs its
/// events. The bridge's receive thread calls poll(); everything else is thread-safe.
class Peers {
 public:
  explicit Peers(const DdsParticipant& participant);
  ~Peers();
  Peers(const Peers&) = delete;
  Peers& operator=(const Peers&) = delete;

  /// Published on the receive thread. Subscribe before the bridge starts.
  [[nodiscard]] In<PeerEvent> events() { return events_; }

  /// Robots of the team ever met by this one, ascending by id.
  [[nodiscard]] std::vector<Peer> list() const;

  [[nodiscard]] std::optional<RobotIdentity> identity_of(const Guid& guid) const;
  [[nodiscard]] bool has_met(RobotId robot, std::uint64_t boot) const;

  // For the bridge.

  /// The listener to create the status reader with, and then that reader.
  [[nodiscard]] const dds_listener_t* liveliness_listener() const { return listener_.get(); }
  void watch(dds_entity_t status_reader) { status_reader_ = status_reader; }

  /// Entities to wait for; when one triggers, or now and then, poll().
  [[nodiscard]] dds_entity_t discovery_condition() const { return discovered_.handle(); }
  [[nodiscard]] dds_entity_t liveliness_condition() const { return liveliness_changed_.handle(); }
  void poll(double now_s);

 private:
  struct LivelinessChange {
    dds_instance_handle_t writer = 0;
    int alive = 0;      // change in the number of living writers
    int not_alive = 0;  // and of silent ones
    int attempts = 0;
  };
  struct ListenerDeleter {
    void operator()(dds_listener_t* listener) const { dds_delete_listener(listener); }
  };

  static void on_liveliness_changed(dds_entity_t reader, dds_liveliness_changed_status_t status,
                                    void* self);
  void take_discovered(double now_s);
  void take_liveliness(double now_s);
  bool apply(const LivelinessChange& change, double now_s);
  std::optional<Guid> participant_of(dds_instance_handle_t writer);
  void publish_events();

  Topic<PeerEvent> events_;
  Guid self_{};
  mutable std::mutex mutex_;  // guards table_ and changes_
  PeerTable table_;
  std::deque<LivelinessChange> changes_;
  std::map<dds_instance_handle_t, Guid> participant_of_writer_;  // receive thread only
  dds_entity_t status_reader_ = 0;
  std::unique_ptr<dds_listener_t, ListenerDeleter> listener_;
  DdsEntity liveliness_changed_;  // guard condition
  DdsEntity reader_;
  DdsEntity discovered_;
};

/// Participant that a reader's or writer's matched counterpart belongs to; nullopt if it is gone.
[[nodiscard]] std::optional<Guid> participant_of_publication(dds_entity_t reader,
                                                             dds_instance_handle_t writer);
[[nodiscard]] std::optional<Guid> participant_of_subscription(dds_entity_t writer,
                                                              dds_instance_handle_t reader);

}  // namespace km
