#include "runtime/dds/incoming_topic.hpp"

#include <dds/ddsi/ddsi_serdata.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <exception>

#include "runtime/clock.hpp"
#include "runtime/dds/envelope.hpp"
#include "runtime/dds/qos.hpp"
#include "runtime/dds/robot_status.hpp"
#include "runtime/log.hpp"

namespace km {
namespace {

constexpr std::size_t kMaxStreams = 4096;  // senders whose message numbers a topic stores
// Maximum time for which a message waits until its writer is known, beyond dds.liveliness_s. DDS
// may deliver messages before it announces their robot. A restarted robot is not accepted until its
// former process is lost.
constexpr double kPatience_s = 6.0;
// Maximum time for which a message waits for its key: the sender repeats a lost key before.
constexpr double kKeyPatience_s = 1.5 * kKeyPeriod_s;
constexpr double kRetry_s = 0.1;
constexpr int kMaxInFlight = 16;
constexpr std::chrono::milliseconds kMaxStay{100};
constexpr std::size_t kFilingBytes = 256;  // bytes of bookkeeping per message

// Bytes that a stored message takes.
std::size_t kept_bytes(const km_wire_Envelope& envelope) {
  return envelope_bytes(envelope.content._length) + kFilingBytes;
}

}  // namespace

std::shared_ptr<void> InFlight::enter() {
  std::unique_lock lock(mutex_);
  left_.wait_for(lock, kMaxStay, [this] { return count_ < kMaxInFlight; });
  ++count_;
  return {this, [self = shared_from_this()](void*) { self->leave(); }};
}

void InFlight::leave() {
  const std::lock_guard lock(mutex_);
  --count_;
  left_.notify_one();
}

IncomingTopic::IncomingTopic(const DdsParticipant& participant, Peers& peers, TopicSpec spec,
                             bool addressed, const QueueQuota& quota, Handler handler)
    : participant_(participant),
      peers_(peers),
      spec_(std::move(spec)),
      addressed_(addressed),
      handler_(std::move(handler)),
      filed_(quota) {
  open();
}

IncomingTopic::~IncomingTopic() {
  stop();
}

void IncomingTopic::open() {
  topic_ = DdsEntity(dds_create_topic(participant_.handle(), &km_wire_Envelope_desc,
                                      spec_.name.c_str(), nullptr, nullptr),
                     "topic " + spec_.name);
  reader_ = make_reader();
  condition_ =
      DdsEntity(dds_create_readcondition(reader_.handle(), DDS_ANY_STATE), "read condition");
}

DdsEntity IncomingTopic::make_reader() {
  const DdsQos partition = make_dds_qos();
  const RobotIdentity& self = participant_.identity();
  if (addressed_)
    dds_qset_partition1(
        partition.get(),
        (spec_.carries_keys ? partition_of(self.robot)
                            : partition_of({self.robot, self.boot}, participant_.seal() != nullptr))
            .c_str());
  subscriber_ = DdsEntity(dds_create_subscriber(participant_.handle(), partition.get(), nullptr),
                          "subscriber of " + spec_.name);
  const std::unique_ptr<dds_listener_t, decltype(&dds_delete_listener)> listener(
      dds_create_listener(nullptr), &dds_delete_listener);
  writers_.listen(listener.get());
  if (spec_.kind == TopicKind::kStatus) {
    peers_.watch(writers_);
    peers_.listen(listener.get());
  }
  const DdsQos qos = make_reader_qos(spec_.kind, participant_.config());
  return {dds_create_reader(subscriber_.handle(), topic_.handle(), qos.get(), listener.get()),
          "reader of " + spec_.name};
}

void IncomingTopic::take(double now_s) {
  constexpr std::uint32_t kBatch = 32;
  while (true) {
    std::array<ddsi_serdata*, kBatch> taken{};
    std::array<dds_sample_info_t, kBatch> infos{};
    const auto count = static_cast<std::size_t>(
        check_dds(dds_takecdr(reader_.handle(), taken.data(), kBatch, infos.data(), DDS_ANY_STATE),
                  "cannot take " + spec_.name));
    if (count == 0) return;
    for (std::size_t i = 0; i < count; ++i) {
      if (infos[i].valid_data) arrive(*taken[i], infos[i].publication_handle, now_s);
      ddsi_serdata_unref(taken[i]);
    }
  }
}

void IncomingTopic::arrive(const ddsi_serdata& serialized, dds_instance_handle_t writer,
                           double now_s) {
  const std::size_t seal_bytes = participant_.seal() == nullptr ? 0 : kTeamSealBytes;
  if (ddsi_serdata_size(&serialized) > envelope_bytes(spec_.max_bytes + seal_bytes))
    return refuse("larger than its topic allows");
  const auto guid = writers_.participant_of(writer);
  if (!guid) return refuse("its writer is unknown");
  Received envelope(static_cast<km_wire_Envelope*>(dds_alloc(sizeof(km_wire_Envelope))));
  *envelope = {};
  if (!ddsi_serdata_to_sample(&serialized, envelope.get(), nullptr, nullptr))
    return refuse("not deserializable");
  if (is_announcement(spec_.kind, envelope->key)) return announce(*envelope, *guid);
  // Messages of a writer stay in order behind its waiting messages.
  Peers::Claim claim = peers_.claim_of(*guid);
  if (claim.later) {
    receive_claim(*envelope, *guid, claim, now_s);
    claim = peers_.claim_of(*guid);
  }
  if (!waiting_.contains(*guid) && is_settled(claim.standing))
    return admit(std::move(envelope), *guid, claim, now_s);
  receive_claim(*envelope, *guid, claim, now_s);
  const std::size_t bytes = kept_bytes(*envelope);
  if (!waiting_.push(*guid, std::move(envelope), bytes, now_s))
    refuse("too many messages from a robot that is not known yet");
}

void IncomingTopic::announce(const km_wire_Envelope& envelope, const Guid& writer) {
  const auto bytes = elements_of(envelope.content, spec_.max_bytes);
  if (!bytes) return refuse("larger than its topic allows");
  peers_.announced(writer, {reinterpret_cast<const char*>(bytes->data()), bytes->size()},
                   envelope.key == kAskingAnnouncement);
}

void IncomingTopic::recall(double now_s) {
  const double patience_s = participant_.config().liveliness_s + kPatience_s;
  const auto take = [&](const Guid& writer, Received& envelope, double waited_s) {
    const Peers::Claim claim = peers_.claim_of(writer);
    if (is_settled(claim.standing)) {
      admit(std::move(envelope), writer, claim, now_s);
      return true;
    }
    if (claim.standing == Standing::kArriving || waited_s < patience_s) return false;
    refuse("its sender is not a known robot, or has not proven its identity");
    return true;
  };
  while (waiting_.serve(now_s, take) > 0) {
  }
}

// True if the handling of a participant's messages is decided.
bool IncomingTopic::is_settled(Standing standing) const {
  const bool is_open = standing == Standing::kUnknown || standing == Standing::kRival ||
                       standing == Standing::kArriving;
  // Key messages arrive before any seal can prove their sender; each is sealed individually.
  return !is_open || (spec_.carries_keys && standing != Standing::kUnknown);
}

void IncomingTopic::admit(Received envelope, const Guid& writer, const Peers::Claim& claim,
                          double now_s) {
  if (claim.standing == Standing::kOutsider) return refuse("its sender is not a known robot");
  if (claim.standing == Standing::kTwin && !spec_.carries_keys) {
    receive_claim(*envelope, writer, claim, now_s);
    return refuse("claims this robot's id");
  }
  file(std::move(envelope), claim.sender, writer, now_s);
}

void IncomingTopic::file(Received envelope, const TeamPeer& sender, const Guid& writer,
                         double now_s) {
  const std::size_t bytes = kept_bytes(*envelope);
  bool fits = true;
  {
    const std::lock_guard lock(mutex_);
    fits = filed_.push(sender.robot, {std::move(envelope), sender, writer}, bytes, now_s);
    filed_changed_.notify_one();
  }
  if (!fits) refuse("no room for it");
}

// Handles a status of a participant that is not (yet) the robot it claims to be, or that was later
// announced as another one. The status of a twin states how long the twin has been running. In a
// team with keys the seal proves the sender.
void IncomingTopic::receive_claim(const km_wire_Envelope& envelope, const Guid& writer,
                                  const Peers::Claim& claim, double now_s) {
  if (spec_.kind != TopicKind::kStatus) return;
  const TeamPeer named{envelope.robot, envelope.boot};
  const bool is_twin = claim.standing == Standing::kTwin && named == claim.sender;
  const bool is_claim = claim.standing == Standing::kRival && named == claim.sender;
  if (!is_twin && !is_claim && named != claim.later) return;
  if (open(envelope, writer).how.status != Opened::Status::kOpened) return;
  if (is_twin) {
    peers_.tell(&PeerTable::twin_received, writer, kStatusPeriod_s * envelope.number,
                now_s - started_s_);
  } else {
    peers_.tell(&PeerTable::prove, writer, named);
  }
}

IncomingTopic::Readable IncomingTopic::open(const km_wire_Envelope& envelope,
                                            const Guid& writer) const {
  const auto bytes = elements_of(envelope.content, spec_.max_bytes + kTeamSealBytes);
  if (!bytes) return {{Opened::Status::kRefused, {}, "larger than its topic allows"}, {}};
  SharedSeal* seal = participant_.seal();
  if (seal == nullptr || spec_.carries_keys)
    return {{Opened::Status::kOpened, {}, nullptr}, *bytes};
  const RobotIdentity& self = participant_.identity();
  const auto addressee = addressed_ ? std::optional(TeamPeer{self.robot, self.boot}) : std::nullopt;
  const SealContext context = seal_context(spec_.name, writer, envelope, addressee);
  Readable result{seal->with([&](TeamSeal& team) { return team.open(context, *bytes); }), {}};
  result.content = result.how.content;  // moving a vector keeps its elements in place
  return result;
}

void IncomingTopic::start() {
  started_s_ = steady_now_s();
  delivery_.start("dds_in", [this] { deliver_until_stopped(); });
}

void IncomingTopic::stop() noexcept {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    filed_changed_.notify_one();
  }
  delivery_.join();
}

void IncomingTopic::deliver_until_stopped() {
  double retry_at_s = 0.0;
  std::unique_lock lock(mutex_);
  while (!stopping_) {
    const double now_s = steady_now_s();
    const bool retry = !sealed_.empty() && now_s >= retry_at_s;
    if (auto filed = filed_.pop(now_s); filed || retry) {
      lock.unlock();
      const Heartbeat::Step step(delivering_);
      if (retry && !deliver_again(now_s)) retry_at_s = now_s + kRetry_s;
      if (filed && deliver(*filed) == Verdict::kNotYet) await_key(std::move(*filed), now_s);
      lock.lock();
      continue;
    }
    std::optional<double> wait_s = filed_.wait_s(now_s);
    if (!sealed_.empty()) wait_s = std::min(kRetry_s, wait_s.value_or(kRetry_s));
    if (wait_s) {
      filed_changed_.wait_for(lock, std::chrono::duration<double>(*wait_s));
    } else {
      filed_changed_.wait(lock);
    }
  }
}

void IncomingTopic::await_key(Filed filed, double now_s) {
  const RobotId sender = filed.sender.robot;
  const std::size_t bytes = kept_bytes(*filed.envelope);
  if (!sealed_.push(sender, std::move(filed), bytes, now_s))
    refuse("too many messages under a key that is not known yet");
}

// For each robot, delivers the oldest message that could not be opened because its key is missing.
// False if none opens yet.
bool IncomingTopic::deliver_again(double now_s) {
  return sealed_.serve(now_s, [this](RobotId /*from*/, const Filed& filed, double waited_s) {
    if (deliver(filed) == Verdict::kTaken) return true;
    if (waited_s < kKeyPatience_s) return false;
    refuse("sealed with a key that is not known");
    return true;
  }) > 0;
}

IncomingTopic::Verdict IncomingTopic::deliver(const Filed& filed) {
  const Readable readable = open(*filed.envelope, filed.writer);
  const Opened::Status status = readable.how.status;
  if (status == Opened::Status::kNotYet) return Verdict::kNotYet;
  const char* reason = status == Opened::Status::kOpened ? pass_to_handler(filed, readable.content)
                                                         : readable.how.reason;
  if (reason != nullptr) refuse(reason);
  return Verdict::kTaken;
}

// Returns the reason of a refusal, otherwise null. A duplicate is dropped without a reason.
const char* IncomingTopic::pass_to_handler(const Filed& filed,
                                           std::span<const std::uint8_t> content) {
  const km_wire_Envelope& envelope = *filed.envelope;
  std::shared_ptr<void> token = in_flight_->enter();  // before is_current(), because it may wait
  if (TeamPeer{envelope.robot, envelope.boot} != filed.sender) return "claims another robot's id";
  if (!spec_.carries_keys && !peers_.ask(&PeerTable::is_current, filed.sender))
    return "from a former process of its robot";
  if (envelope.version == 0) return "unknown version of the topic";
  if (content.size() > spec_.max_bytes) return "larger than its topic allows";
  {
    const std::lock_guard lock(mutex_);
    if (!is_new(filed.sender, envelope.number)) {
      ++duplicates_;
      return nullptr;
    }
    from_[filed.sender.robot].add(envelope_bytes(envelope.content._length));
  }
  try {
    return handler_(filed.sender, content, std::move(token));
  } catch (const std::exception& e) {
    log::limited(log::Level::kError, "dds", spec_.name + e.what())
        << spec_.name << ": " << e.what();
    return "its handling threw an exception";
  }
}

bool IncomingTopic::is_new(const TeamPeer& sender, std::uint32_t number) {
  if (streams_.size() >= kMaxStreams && !streams_.contains(sender)) streams_.clear();
  return streams_[sender].is_new(number);
}

void IncomingTopic::refuse(const char* reason) {
  {
    const std::lock_guard lock(mutex_);
    ++refused_[reason];
  }
  log::limited(log::Level::kWarn, "dds", spec_.name + reason)
      << spec_.name << ": message refused: " << reason;
}

void IncomingTopic::add_to(TrafficSnapshot& snapshot) const {
  TopicTraffic total{.topic = spec_.name, .category = spec_.category, .direction = Direction::kIn};
  const std::lock_guard lock(mutex_);
  for (const auto& [robot, count] : from_) {
    total.count.add(count);
    snapshot.peers.push_back({.topic = spec_.name,
                              .category = spec_.category,
                              .direction = Direction::kIn,
                              .peer = robot,
                              .count = count});
  }
  total.duplicates = duplicates_;
  total.refused = refused_;
  snapshot.topics.push_back(std::move(total));
}

}  // namespace km
