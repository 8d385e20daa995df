#include "runtime/dds/sender.hpp"

#include <algorithm>
#include <utility>

#include "runtime/clock.hpp"
#include "runtime/dds/envelope.hpp"
#include "runtime/log.hpp"

namespace km {
namespace {

constexpr double kTick_s = 0.25;  // interval for unannounced changes: readers and retransmissions
constexpr double kLast_s = 2.0;   // time for the remaining messages at the end
constexpr std::size_t kHeldForNobody = 4096;

}  // namespace

Sender::Sender(const BudgetConfig& budget, const DdsParticipant& participant,
               const std::vector<std::unique_ptr<OutgoingTopic>>& topics,
               const OutgoingTopic* beside)
    : participant_(participant),
      topics_(topics),
      beside_(beside),
      posted_(kQueue, Overflow::kBlock),
      schedule_(budget),
      heartbeat_([this] { posted_.close(); }) {}

void Sender::stop() noexcept {
  posted_.close();
  thread_.join();
}

void Sender::post(Outgoing message) {
  const Heartbeat::Waiting waiting;  // push() may wait for room
  posted_.push(std::move(message));
}

void Sender::catch_up(RobotId robot) {
  const std::lock_guard lock(mutex_);
  due_.insert(robot);
}

void Sender::renew(RobotId robot) {
  const std::lock_guard lock(mutex_);
  renewals_.insert(robot);
}

std::map<const OutgoingTopic*, HeldBack> Sender::held_back() const {
  const std::lock_guard lock(mutex_);
  return held_;
}

void Sender::run() {
  std::optional<double> end_s;
  while (true) {
    if (work()) continue;
    const double now_s = steady_now_s();
    if (posted_.is_over()) {
      if (!end_s) end_s = now_s + kLast_s;
      if (schedule_.size() == 0 || now_s >= *end_s) break;
    }
    const double wait_s = std::min(schedule_.wait_s().value_or(kTick_s), kTick_s);
    if (posted_.is_over())
      std::this_thread::sleep_for(steady_duration(wait_s));
    else if (const auto message = posted_.pop_within(steady_duration(wait_s)))
      file(*message);
  }
  schedule_.drop_all();
  report();
}

// False if no message may be sent now.
bool Sender::work() {
  const auto use = participant_.use();
  catch_up_due();
  file_posted();
  return send_next();
}

// Bypasses the budget; settle() charges the bytes afterwards.
void Sender::catch_up_due() {
  std::set<RobotId> due, renewals;
  {
    const std::lock_guard lock(mutex_);
    due.swap(due_);
    renewals.swap(renewals_);
  }
  const Heartbeat::Step step(heartbeat_);
  // A writer is renewed only if its reader has acknowledged all messages. Otherwise the messages
  // wait for the budget or travel over a slow link. A reader that ignores the writer because of
  // forged packets acknowledges all messages.
  std::erase_if(renewals, [this](RobotId robot) {
    return holds_back_ || std::ranges::any_of(topics_, [&](const auto& topic) {
             return !topic->is_acknowledged_by(robot);
           });
  });
  for (const RobotId robot : renewals)
    for (const auto& topic : topics_) topic->renew(robot);
  for (const RobotId robot : due)
    for (const auto& topic : topics_) topic->catch_up(robot);
}

// Files the posted messages, but only a few at once, so that sending continues. Without a budget,
// posting threads wait for room; with a budget, the schedule makes room.
void Sender::file_posted() {
  constexpr int kAtOnce = 64;
  for (int k = 0; k < kAtOnce && (schedule_.is_limited() || schedule_.size() < kQueue); ++k) {
    const auto message = posted_.pop_within({});
    if (!message) return;
    file(*message);
  }
}

// False if no message may be sent now.
bool Sender::send_next() {
  const double now_s = steady_now_s();
  settle(now_s);
  auto next = schedule_.pop(now_s, [this](const auto& entry) { return readers_of(entry); });
  if (!next) {
    holds_back_ = schedule_.wait_s().has_value();
    report();
    return false;
  }
  const Heartbeat::Step step(heartbeat_);
  const auto scope = timing_.measure();
  next->topic->write(next->message.to, next->key, std::move(next->message.content));
  return true;
}

void Sender::file(const Outgoing& message) {
  const Heartbeat::Step step(heartbeat_);
  const auto scope = timing_.measure();
  const TopicSpec& spec = message.topic->spec();
  const TopicKind kind = spec.kind;
  Schedule::Entry entry{.topic = message.topic,
                        .priority = priority_of(kind, spec.category),
                        .newest_wins = kind == TopicKind::kState || kind == TopicKind::kStatus,
                        .key = message.key,
                        .message = {message.to, message.encode()}};
  if (message.to) entry.to = message.to->robot;
  entry.bytes = envelope_bytes(entry.message.content.size());
  if (kind == TopicKind::kRequest) entry.useful_s = participant_.config().lease_s;
  schedule_.push(std::move(entry), steady_now_s());
}

std::optional<std::vector<RobotId>> Sender::readers_of(const Schedule::Entry& entry) const {
  OutgoingTopic& topic = *entry.topic;
  std::vector<RobotId> readers = topic.readers_of(entry.message.to);
  const bool may_wait = !entry.to && is_reliable(topic.spec().kind) && !posted_.is_over() &&
                        schedule_.size() < kHeldForNobody;
  if (readers.empty() && may_wait) return std::nullopt;
  return readers;
}

// Messages that DDS sends to new readers are charged first.
void Sender::settle(double now_s) {
  const bool is_due = now_s - settled_s_ >= kTick_s;
  if (is_due) {
    settled_s_ = now_s;
    for (const auto& topic : topics_) topic->notice_readers();
  }
  bool have_come = false;
  for (const auto& topic : topics_) have_come |= topic->take_newcomers();
  if (!schedule_.is_limited() || (!is_due && !have_come)) return;
  std::uint64_t sent_bytes = beside_ == nullptr ? 0 : beside_->sent_bytes();
  for (const auto& topic : topics_) sent_bytes += topic->sent_bytes();
  schedule_.settle(sent_bytes, now_s);
}

void Sender::report() {
  if (!schedule_.is_limited()) return;
  bool lost = false;
  {
    const std::lock_guard lock(mutex_);
    held_.clear();
    for (const auto& [topic, held] : schedule_.held_back()) {
      held_[topic] = held;
      lost |= held.dropped.messages > 0;
    }
  }
  if (holds_back_ && !std::exchange(delay_reported_, true))
    log::info("dds") << "the budget is used up for now: messages wait, see traffic.csv";
  if (lost && !std::exchange(loss_reported_, true))
    log::warn("dds") << "messages are not sent because the budget is used up, see traffic.csv";
}

}  // namespace km
