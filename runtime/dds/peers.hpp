#pragma once

#include <deque>
#include <exception>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string_view>
#include <type_traits>
#include <vector>

#include "runtime/dds/entity.hpp"
#include "runtime/dds/participant.hpp"
#include "runtime/dds/peer_table.hpp"
#include "runtime/topic.hpp"
#include "runtime/worker.hpp"

namespace km {

/// Participant of each writer of a topic, stored when DDS matches the writer. Messages of a removed
/// writer are thus still attributed to its robot. Thread-safe.
class WriterBook {
 public:
  WriterBook() = default;
  WriterBook(const WriterBook&) = delete;
  WriterBook& operator=(const WriterBook&) = delete;

  /// Adds itself to the listener with which the topic's reader is created.
  void listen(dds_listener_t* listener);

  /// nullopt for a writer that has never been matched.
  [[nodiscard]] std::optional<Guid> participant_of(dds_instance_handle_t writer) const;

 private:
  static void on_matched(dds_entity_t reader, dds_subscription_matched_status_t status, void* self);

  mutable std::mutex mutex_;  // guards the members below
  std::map<dds_instance_handle_t, Guid> participant_of_;
  std::deque<dds_instance_handle_t> gone_;  // oldest first
};

/// Detects when all subscribers have released an event. Thread-safe.
class EventReceipts : public std::enable_shared_from_this<EventReceipts> {
 public:
  /// Returns the event; take() returns its process once all copies of the event are released.
  [[nodiscard]] Topic<PeerEvent>::Message track(PeerEvent event);

  /// The result is empty afterwards.
  [[nodiscard]] std::vector<TeamPeer> take();

 private:
  std::mutex mutex_;  // guards handled_
  std::vector<TeamPeer> handled_;
};

/// Feeds a PeerTable from DDS discovery and from the liveliness of the status topic, and logs its
/// events. The bridge's receive thread calls poll(); everything else is thread-safe.
class Peers {
 public:
  explicit Peers(const DdsParticipant& participant);
  Peers(const Peers&) = delete;
  Peers& operator=(const Peers&) = delete;

  /// Events are published on a thread of their own. Subscribe before start(). While any copy of a
  /// kRestarted exists, messages of its process wait.
  [[nodiscard]] In<PeerEvent> events() { return events_; }

  /// Returns the result of a member function of PeerTable. Thread-safe.
  template <typename Result, typename... Parameters>
  [[nodiscard]] Result ask(Result (PeerTable::*question)(Parameters...) const,
                           const std::type_identity_t<Parameters>&... arguments) const {
    const std::lock_guard lock(mutex_);
    return (table_.*question)(arguments...);
  }
  /// Calls a member function of PeerTable, and publishes the resulting events. Thread-safe.
  template <typename... Parameters>
  void tell(void (PeerTable::*report)(Parameters...),
            const std::type_identity_t<Parameters>&... arguments) {
    {
      const std::lock_guard lock(mutex_);
      (table_.*report)(arguments...);
    }
    publish_events();
  }
  /// Robots of the team ever met by this one, ascending by id.
  [[nodiscard]] std::vector<Peer> list() const { return ask(&PeerTable::peers); }

  /// Handling of the messages of a participant, and its claimed identity.
  struct Claim {
    Standing standing = Standing::kUnknown;
    TeamPeer sender;                     ///< Set for a robot: neither kUnknown nor kOutsider.
    std::optional<TeamPeer> later = {};  ///< See PeerTable::later_claim_of().
  };
  [[nodiscard]] Claim claim_of(const Guid& guid) const;

  /// Any program can forge the announcements that DDS carries, and DDS then drops the true ones.
  /// While statuses of unknown senders arrive, a robot therefore announces itself in its status
  /// topic, and asks for answers, with the keys of this process. Returns whether to announce itself
  /// now: kAsks if others shall answer.
  enum class AnnouncementDue { kNo, kAnswers, kAsks };
  [[nodiscard]] AnnouncementDue take_announcement_due(double now_s);
  /// Handles such an announcement of a participant.
  void announced(const Guid& guid, std::string_view user_data, bool asks);

  /// True if PeerTable::is_isolated() has held for long: DdsParticipant::move_to() the same
  /// interface then discards what DDS has taken from forged announcements.
  [[nodiscard]] bool take_isolation(double now_s);

  /// Processes whose credentials were admitted since the last call: they need the key of this
  /// process.
  [[nodiscard]] std::vector<TeamPeer> take_admitted();

  // For the bridge.

  /// Creates the DDS entities, again after DdsParticipant::move_to(): all robots count as lost
  /// until they are received again.
  void open();

  /// Prepares the listener of the status reader, and stores the writers of the status topic.
  void listen(dds_listener_t* listener);
  void watch(const WriterBook& status_writers) { status_writers_ = &status_writers; }

  /// Call poll() when one of these conditions triggers, and at intervals.
  [[nodiscard]] dds_entity_t discovery_condition() const { return discovered_.handle(); }
  [[nodiscard]] dds_entity_t liveliness_condition() const { return liveliness_changed_.handle(); }
  void poll();

  void start() { announcer_.start(); }
  void stop() noexcept { announcer_.stop(); }
  [[nodiscard]] std::exception_ptr error() const { return announcer_.error(); }

 private:
  struct LivelinessChange {
    dds_instance_handle_t writer = 0;
    int alive = 0;      // change in the number of living writers
    int not_alive = 0;  // change in the number of silent writers
    int attempts = 0;
  };
  static void on_liveliness_changed(dds_entity_t reader, dds_liveliness_changed_status_t status,
                                    void* self);
  const char* admit(const RobotIdentity& identity, std::string_view credentials);
  void take_discovered();
  void take(const dds_builtintopic_participant_t& sample, const dds_sample_info_t& info);
  void remove_gone();
  void announce(const Guid& guid);
  void take_liveliness();
  bool apply(const LivelinessChange& change);
  void publish_events();

  Topic<PeerEvent> events_;
  const DdsParticipant& participant_;
  SharedSeal* const seal_;    // may be null
  mutable std::mutex mutex_;  // guards the members below, up to changes_
  PeerTable table_;
  std::vector<TeamPeer> admitted_;
  std::set<Guid> askers_;  // since the last announcement
  std::optional<double> strangers_since_s_;
  std::optional<double> isolated_since_s_;
  int renewals_ = 0;  // number of new participants
  double next_announcement_s_ = 0.0;
  std::deque<LivelinessChange> changes_;
  const WriterBook* status_writers_ = nullptr;
  DdsEntity liveliness_changed_;  // guard condition
  DdsEntity reader_;
  DdsEntity discovered_;
  std::shared_ptr<EventReceipts> receipts_ = std::make_shared<EventReceipts>();
  Worker<Topic<PeerEvent>::Message> announcer_;  // last member: stops first
};

/// Participant that a writer's matched reader belongs to; nullopt if it is gone.
[[nodiscard]] std::optional<Guid> participant_of_subscription(dds_entity_t writer,
                                                              dds_instance_handle_t reader);

}  // namespace km
