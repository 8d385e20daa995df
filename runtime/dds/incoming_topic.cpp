#include "runtime/dds/incoming_topic.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <exception>

#include "runtime/clock.hpp"
#include "runtime/dds/envelope.hpp"
#include "runtime/dds/qos.hpp"
#include "runtime/dds/robot_status.hpp"
#include "runtime/log.hpp"
#include "runtime/thread.hpp"

namespace km {
namespace {

constexpr std::size_t kMaxStreams = 4096;  // boots of robots remembered per topic
// For a writer to become known: DDS may tell of its messages before its robot is heard, and a
// robot that is killed and started again waits for its former self to be missed.
constexpr double kPatience_s = 8.0;
constexpr std::size_t kMaxWaiting = 512;
constexpr std::size_t kMaxWaitingOfOne = 64;
constexpr int kMaxInFlight = 16;
constexpr std::chrono::milliseconds kMaxStay{100};
constexpr std::size_t kFilingBytes = 256;  // that a message takes beside its own

// An envelope as DDS reads it: one count and what it counts.
class ReceivedEnvelope {
 public:
  explicit ReceivedEnvelope(const ddsi_serdata& serialized)
      : usable_(ddsi_serdata_to_sample(&serialized, &envelope_, nullptr, nullptr)) {}
  ~ReceivedEnvelope() { dds_sample_free(&envelope_, &km_wire_Envelope_desc, DDS_FREE_CONTENTS); }
  ReceivedEnvelope(const ReceivedEnvelope&) = delete;
  ReceivedEnvelope& operator=(const ReceivedEnvelope&) = delete;

  [[nodiscard]] bool usable() const { return usable_; }
  [[nodiscard]] const km_wire_Envelope& get() const { return envelope_; }

 private:
  km_wire_Envelope envelope_{};
  bool usable_;
};

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
      handler_(std::move(handler)),
      filed_(quota),
      topic_(dds_create_topic(participant.handle(), &km_wire_Envelope_desc, spec_.name.c_str(),
                              nullptr, nullptr),
             "topic " + spec_.name),
      reader_(make_reader(addressed)),
      condition_(dds_create_readcondition(reader_.handle(), DDS_ANY_STATE), "read condition") {}

IncomingTopic::~IncomingTopic() {
  stop();
}

DdsEntity IncomingTopic::make_reader(bool addressed) {
  const DdsQos partition = make_dds_qos();
  if (addressed)
    dds_qset_partition1(partition.get(), partition_of(participant_.identity().robot).c_str());
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
    std::array<Serdata, kBatch> owners;
    for (std::size_t i = 0; i < count; ++i) owners[i].reset(taken[i]);
    for (std::size_t i = 0; i < count; ++i)
      if (infos[i].valid_data) arrive(std::move(owners[i]), infos[i].publication_handle, now_s);
  }
}

void IncomingTopic::arrive(Serdata serialized, dds_instance_handle_t writer, double now_s) {
  if (ddsi_serdata_size(serialized.get()) > envelope_bytes(spec_.max_bytes))
    return refuse("larger than its topic allows");
  const auto guid = writers_.participant_of(writer);
  if (!guid) return refuse("from no known writer");
  if (admit(serialized, *guid, now_s)) return;
  const auto of_one = std::ranges::count(waiting_, *guid, &Waiting::writer);
  if (waiting_.size() >= kMaxWaiting || of_one >= static_cast<std::ptrdiff_t>(kMaxWaitingOfOne))
    return refuse("one too many from a robot that is not known yet");
  waiting_.push_back({std::move(serialized), *guid, now_s});
}

void IncomingTopic::recall(double now_s) {
  const auto is_settled = [&](Waiting& message) {
    if (admit(message.serialized, message.writer, now_s)) return true;
    if (now_s - message.since_s < kPatience_s) return false;
    const bool rival = peers_.claim_of(message.writer).standing == Standing::kRival;
    refuse(rival ? "claims another robot's id" : "from no known robot");
    return true;
  };
  std::erase_if(waiting_, is_settled);
}

// Files or refuses the message; false if it is not known yet which.
bool IncomingTopic::admit(Serdata& serialized, const Guid& writer, double now_s) {
  const Peers::Claim claim = peers_.claim_of(writer);
  switch (claim.standing) {
    case Standing::kUnknown:
    case Standing::kRival:
      return false;
    case Standing::kStranger:
      refuse("from no known robot");
      return true;
    case Standing::kTwin:
      hear_twin(*serialized, writer, now_s);
      refuse("claims this robot's id");
      return true;
    case Standing::kAdmitted:
      break;
  }
  const std::size_t bytes = ddsi_serdata_size(serialized.get()) + kFilingBytes;
  bool fits = true;
  {
    const std::lock_guard lock(mutex_);
    fits = filed_.push(claim.sender.robot, {std::move(serialized), claim.sender}, bytes, now_s);
    filed_changed_.notify_one();
  }
  if (!fits) refuse("for want of room");
  return true;
}

// The numbers of a twin's statuses tell how long it has been running.
void IncomingTopic::hear_twin(const ddsi_serdata& serialized, const Guid& writer, double now_s) {
  if (spec_.kind != TopicKind::kStatus || !first_s_) return;
  const ReceivedEnvelope received(serialized);
  if (received.usable())
    peers_.twin_heard(writer, kStatusPeriod_s * received.get().number, now_s - *first_s_);
}

void IncomingTopic::start() {
  first_s_ = steady_now_s();
  delivery_ = std::thread(&IncomingTopic::deliver_until_stopped, this);
}

void IncomingTopic::stop() noexcept {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    filed_changed_.notify_one();
  }
  if (delivery_.joinable()) delivery_.join();
}

void IncomingTopic::deliver_until_stopped() try {
  name_this_thread("dds_in");
  std::unique_lock lock(mutex_);
  while (!stopping_) {
    const double now_s = steady_now_s();
    if (const auto filed = filed_.pop(now_s)) {
      lock.unlock();
      if (const char* reason = deliver(*filed)) refuse(reason);
      lock.lock();
    } else if (const auto wait_s = filed_.wait_s(now_s)) {
      filed_changed_.wait_for(lock, std::chrono::duration<double>(*wait_s));
    } else {
      filed_changed_.wait(lock);
    }
  }
} catch (...) {
  error_ = std::current_exception();
  failed_ = true;  // after error_: publishes it
}

// Null, or why the message is refused. A duplicate is neither.
const char* IncomingTopic::deliver(const Filed& filed) {
  const ReceivedEnvelope received(*filed.serialized);
  if (!received.usable()) return "not deserializable";
  return accept(received.get(), filed.sender, ddsi_serdata_size(filed.serialized.get()));
}

const char* IncomingTopic::accept(const km_wire_Envelope& envelope, const Sender& sender,
                                  std::uint64_t size) {
  if (Sender{envelope.robot, envelope.boot} != sender) return "claims another robot's id";
  if (!peers_.is_current(sender)) return "from a former process of its robot";
  if (envelope.version == 0) return "unknown version of the topic";
  const auto content = elements_of(envelope.content, spec_.max_bytes);
  if (!content) return "larger than its topic allows";
  {
    const std::lock_guard lock(mutex_);
    if (!is_new(sender, envelope.number)) {
      ++duplicates_;
      return nullptr;
    }
    from_[sender.robot].add(size);
  }
  try {
    return handler_(sender, *content, in_flight_->enter());
  } catch (const std::exception& e) {
    log::limited(log::Level::kError, "dds", spec_.name + e.what())
        << spec_.name << ": " << e.what();
    return "its handling threw an exception";
  }
}

bool IncomingTopic::is_new(const Sender& sender, std::uint32_t number) {
  if (streams_.size() >= kMaxStreams && !streams_.contains(sender)) streams_.clear();
  const auto entry = streams_.try_emplace(sender, has_full_history(spec_.kind)).first;
  return entry->second.is_new(number);
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
  TopicTraffic total{.topic = spec_.name,
                     .category = spec_.category,
                     .direction = Direction::kIn,
                     .count = {},
                     .refused = {}};
  const std::lock_guard lock(mutex_);
  for (const auto& [robot, count] : from_) {
    total.count.messages += count.messages;
    total.count.bytes += count.bytes;
    snapshot.peers.push_back({.topic = spec_.name,
                              .category = spec_.category,
                              .direction = Direction::kIn,
                              .peer = robot,
                              .count = count});
  }
  for (const auto& [sender, tracker] : streams_) total.missing += tracker.missing();
  total.duplicates = duplicates_;
  total.refused = refused_;
  snapshot.topics.push_back(std::move(total));
}

}  // namespace km
