#pragma once

#include <atomic>
#include <cstdint>
#include <exception>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <vector>

#include "runtime/bounded_queue.hpp"
#include "runtime/dds/dds_config.hpp"
#include "runtime/dds/outgoing_topic.hpp"
#include "runtime/dds/send_schedule.hpp"
#include "runtime/guarded_thread.hpp"
#include "runtime/heartbeat.hpp"
#include "runtime/metrics.hpp"

namespace km {

/// A message to be sent.
struct Outgoing {
  OutgoingTopic* topic = nullptr;
  std::optional<Addressee> to = {};  ///< Empty: all.
  MessageKey key = 0;
  std::function<std::vector<std::uint8_t>()> encode = {};  ///< Called on the sender's thread.
};

/// Encodes messages and writes them on a thread of its own, in the order of SendSchedule. With a
/// budget, messages to all robots wait, within bounds, while there is no receiver: DDS would send
/// all of them to a new reader at once.
class Sender {
 public:
  /// Number of messages that may wait to be encoded; then post() waits.
  static constexpr std::size_t kQueue = 8192;

  /// `topics` are all topics of its messages, of `participant`, and outlive it; the list may grow
  /// until start().
  /// Another thread writes `beside`, whose bytes also count against the budget; null: there is no
  /// such topic. Requests wait no longer than dds.lease_s. Throws ConfigError.
  Sender(const BudgetConfig& budget, const DdsParticipant& participant,
         const std::vector<std::unique_ptr<OutgoingTopic>>& topics,
         const OutgoingTopic* beside = nullptr);
  ~Sender() { stop(); }
  Sender(const Sender&) = delete;
  Sender& operator=(const Sender&) = delete;

  void start() {
    thread_.start(
        "dds_send", [this] { run(); }, [this] { posted_.close(); });
  }

  /// Sends the queued messages, with a budget as much as it permits within two seconds, and joins.
  /// Idempotent.
  void stop() noexcept;

  /// Thread-safe.
  void post(Outgoing message);

  /// Requests OutgoingTopic::catch_up() of every topic for `robot`. Does not wait. Thread-safe.
  void catch_up(RobotId robot);
  /// Requests OutgoingTopic::renew() of every topic for `robot`, unless messages still wait for the
  /// budget or for its acknowledgement. Does not wait. Thread-safe.
  void renew(RobotId robot);

  /// True while messages wait for the budget. Thread-safe.
  [[nodiscard]] bool holds_back() const { return holds_back_; }
  /// Thread-safe.
  [[nodiscard]] std::map<const OutgoingTopic*, HeldBack> held_back() const;

  /// The exception that ended the thread, or null. Thread-safe.
  std::exception_ptr error() const { return thread_.error(); }
  Heartbeat& heartbeat() { return heartbeat_; }
  /// Durations of encoding and writing each message. Thread-safe.
  DurationHistogram timing() const { return timing_.histogram(); }

 private:
  struct Encoded {
    std::optional<Addressee> to;
    std::vector<std::uint8_t> content;
  };
  using Schedule = SendSchedule<OutgoingTopic*, Encoded>;

  void run();
  bool work();
  void catch_up_due();
  void file_posted();
  bool send_next();
  void file(const Outgoing& message);
  void settle(double now_s);
  void report();
  [[nodiscard]] std::optional<std::vector<RobotId>> readers_of(const Schedule::Entry& entry) const;

  const DdsParticipant& participant_;
  const std::vector<std::unique_ptr<OutgoingTopic>>& topics_;
  const OutgoingTopic* beside_;
  BoundedQueue<Outgoing> posted_;
  Schedule schedule_;  // used by the thread only, up to loss_reported_
  double settled_s_ = 0.0;
  bool delay_reported_ = false, loss_reported_ = false;
  std::atomic<bool> holds_back_ = false;
  mutable std::mutex mutex_;  // guards held_, due_ and renewals_
  std::map<const OutgoingTopic*, HeldBack> held_;
  std::set<RobotId> due_;       // robots that have to catch up
  std::set<RobotId> renewals_;  // robots whose writers have to be renewed
  Heartbeat heartbeat_;
  Timing timing_;
  GuardedThread thread_;
};

}  // namespace km
