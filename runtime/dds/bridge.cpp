#include "runtime/dds/bridge.hpp"

#include <chrono>

#include "runtime/clock.hpp"
#include "runtime/log.hpp"

namespace km {
namespace {

constexpr std::chrono::seconds kAcknowledgementTime{2};
constexpr std::size_t kMaxKeyMessageBytes = 512;
constexpr dds_duration_t kWakeUp = DDS_MSECS(250);  // interval for changes that only the clock
                                                    // causes

// Bound on the waiting messages of one peer on a topic of this kind.
QueueQuota quota_of(TopicKind kind, Pace pace) {
  QueueQuota quota{.per_second = pace.per_second, .burst = pace.burst};
  quota.newest_wins = kind == TopicKind::kStatus || kind == TopicKind::kState;
  if (kind == TopicKind::kStatus) quota.messages = 8;
  return quota;
}

TopicSpec key_topic() {
  return {.name = "team_keys",
          .max_bytes = kMaxKeyMessageBytes,
          .kind = TopicKind::kState,
          .carries_keys = true};
}

// Null without keys.
std::unique_ptr<OutgoingTopic> make_key_topic(const DdsParticipant& participant, Peers& peers) {
  if (participant.seal() == nullptr) return nullptr;
  return std::make_unique<OutgoingTopic>(participant, peers, key_topic());
}

// Attachment numbers of the wait set; incoming topics follow.
constexpr dds_attach_t kOther = 0;
constexpr dds_attach_t kFirstTopic = 1;

}  // namespace

DdsBridge::DdsBridge(DdsParticipant& participant, const BudgetConfig& budget)
    : participant_(participant),
      peers_(participant),
      keys_(make_key_topic(participant, peers_)),
      key_sender_(
          kMaxAdmitted, Overflow::kDropOldest, [this](const TeamPeer& peer) { send_key(peer); },
          "dds_keys"),
      sender_(budget, participant, outgoing_, keys_.get()) {
  open_waitset();
  if (keys_ == nullptr) return;
  receive_keys();
  peers_.events().subscribe([this](const auto& event) { catch_up(*event); });
}

DdsBridge::~DdsBridge() {
  stop();
}

void DdsBridge::attach(dds_entity_t condition, dds_attach_t number) {
  check_dds(dds_waitset_attach(waitset_.handle(), condition, number), "cannot wait");
}

void DdsBridge::open_waitset() {
  waitset_ = DdsEntity(dds_create_waitset(participant_.handle()), "wait set");
  stop_request_ = DdsEntity(dds_create_guardcondition(participant_.handle()), "guard condition");
  for (const dds_entity_t condition :
       {stop_request_.handle(), peers_.discovery_condition(), peers_.liveliness_condition()})
    attach(condition, kOther);
  dds_attach_t number = kFirstTopic;
  for (const auto& topic : incoming_) attach(topic->condition(), number++);
}

void DdsBridge::move_to(const NetworkInterface& interface) {
  const auto alone = participant_.use_alone();
  const auto for_each_outgoing = [this](const auto& action) {
    if (keys_ != nullptr) action(*keys_);
    for (const auto& topic : outgoing_) action(*topic);
  };
  {
    const auto domain = static_cast<dds_domainid_t>(participant_.config().domain);
    const DdsEntity reader(dds_create_participant(domain, nullptr, nullptr),
                           "participant to copy messages");
    for_each_outgoing([&](OutgoingTopic& topic) { topic.save(reader.handle()); });
  }
  participant_.move_to(interface);
  peers_.open();
  for (const auto& topic : incoming_) topic->open();
  open_waitset();
  for_each_outgoing([](OutgoingTopic& topic) { topic.open(); });
}

void DdsBridge::receive_keys() {
  add_incoming(
      key_topic(), true, {},
      [seal = participant_.seal()](const TeamPeer& sender, auto content, const auto&) {
        return seal->with([&](TeamSeal& team) { return team.accept_key_message(sender, content); });
      });
}

void DdsBridge::send_key(const TeamPeer& peer) {
  const auto use = participant_.use();
  auto message =
      participant_.seal()->with([&](TeamSeal& team) { return team.key_message_for(peer); });
  if (message) keys_->write(Addressee{peer.robot}, message_key({peer.boot}), *std::move(message));
}

void DdsBridge::send_keys() {
  if (keys_ == nullptr) return;
  for (const Peer& peer : peers_.list())
    if (peer.state == PeerState::kAlive)
      key_sender_.post({peer.identity.robot, peer.identity.boot});
}

void DdsBridge::apply(const MembershipChange& change) {
  peers_.tell(&PeerTable::expel, change.forgotten);
  if (change.new_key) send_keys();
}

void DdsBridge::catch_up(const PeerEvent& event) {
  if (event.kind != PeerEventKind::kReturned && event.kind != PeerEventKind::kResumed) return;
  sender_.catch_up(event.identity.robot);
}

OutgoingTopic& DdsBridge::add_outgoing(TopicSpec spec) {
  outgoing_.push_back(std::make_unique<OutgoingTopic>(participant_, peers_, std::move(spec)));
  return *outgoing_.back();
}

void DdsBridge::add_incoming(TopicSpec spec, bool addressed, Pace pace,
                             IncomingTopic::Handler handler) {
  const QueueQuota quota = quota_of(spec.kind, pace);
  incoming_.push_back(std::make_unique<IncomingTopic>(participant_, peers_, std::move(spec),
                                                      addressed, quota, std::move(handler)));
  const auto number = kFirstTopic + static_cast<dds_attach_t>(incoming_.size() - 1);
  attach(incoming_.back()->condition(), number);
}

TrafficSnapshot DdsBridge::traffic() const {
  TrafficSnapshot snapshot;
  const auto held = sender_.held_back();
  const auto use = participant_.use();
  if (keys_ != nullptr) keys_->add_to(snapshot);
  for (const auto& topic : outgoing_) {
    topic->add_to(snapshot);
    if (const auto found = held.find(topic.get()); found != held.end())
      snapshot.topics.back().held = found->second;
  }
  for (const auto& topic : incoming_) topic->add_to(snapshot);
  return snapshot;
}

void DdsBridge::start() {
  sender_.start();
  if (keys_ != nullptr) key_sender_.start();
  peers_.start();
  for (const auto& topic : incoming_) topic->start();
  receiver_.start("dds_receive", [this] { receive_until_stopped(); });
}

void DdsBridge::stop() noexcept {
  if (std::exchange(stopped_, true)) return;
  sender_.stop();
  key_sender_.stop();
  if (!receiver_.joinable()) return;
  finish_receiving();
  receiver_.join();
  for (const auto& topic : incoming_) topic->stop();
  peers_.stop();
}

std::exception_ptr DdsBridge::error() const {
  for (const auto& topic : incoming_)
    if (const auto error = topic->error()) return error;
  return first_of({receiver_.error(), sender_.error(), key_sender_.error(), peers_.error()});
}

std::vector<Heartbeat*> DdsBridge::heartbeats() {
  std::vector<Heartbeat*> all{&receiving_, &sender_.heartbeat(), &key_sender_.heartbeat()};
  for (const auto& topic : incoming_) all.push_back(&topic->heartbeat());
  return all;
}

void DdsBridge::receive_until_stopped() {
  std::vector<dds_attach_t> triggered(incoming_.size() + 3);
  while (!stopping_) {
    const dds_return_t count =
        check_dds(dds_waitset_wait(waitset_.handle(), triggered.data(), triggered.size(), kWakeUp),
                  "cannot wait for messages");
    const Heartbeat::Step step(receiving_);
    // Peers are updated before their messages are read.
    const double now_s = steady_now_s();
    peers_.poll();
    for (const TeamPeer& peer : peers_.take_admitted()) key_sender_.post(peer);
    if (now_s - keys_sent_s_ >= kKeyPeriod_s) {
      keys_sent_s_ = now_s;
      send_keys();
    }
    const auto n = std::min(triggered.size(), static_cast<std::size_t>(count));
    for (std::size_t i = 0; i < n; ++i)
      if (triggered[i] >= kFirstTopic)
        incoming_[static_cast<std::size_t>(triggered[i] - kFirstTopic)]->take(now_s);
    for (const auto& topic : incoming_) topic->recall(now_s);
    if (const auto interface = participant_.new_interface(now_s)) {
      move_to(*interface);
    } else if (participant_.can_move() && peers_.take_isolation(now_s)) {
      log::warn("dds")
          << "robots are announced, but nothing arrives from them: if the announcements "
             "are forged, a new participant helps";
      move_to(NetworkInterface(participant_.interface()));
    }
  }
}

void DdsBridge::finish_receiving() noexcept {
  const auto use = participant_.use();
  const auto deadline = std::chrono::steady_clock::now() + kAcknowledgementTime;
  bool complete = true;
  const auto await = [&](OutgoingTopic& topic) {
    const auto left = deadline - std::chrono::steady_clock::now();
    complete &= topic.wait_for_acks(std::max(left, decltype(left)::zero()));
  };
  if (keys_ != nullptr) await(*keys_);
  for (const auto& topic : outgoing_) await(*topic);
  if (!complete) log::warn("dds") << "closing before every peer has acknowledged every message";
  stopping_ = true;
  dds_set_guardcondition(stop_request_.handle(), true);
}

}  // namespace km
