#include "modules/session/reliable_channel.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace km {
namespace {

// Timeout of the first repetition, as a multiple of the mean response time. Later timeouts grow.
constexpr double kPatience = 2.0;
constexpr double kMeanOver = 8.0;  // number of messages in the mean
// Bounds of the timeout [periods].
constexpr double kLeastPatience = 0.2;
constexpr double kMostPatience = 3.0;
// Rate of repetitions of large messages [bytes/s]. As long as two robots are connected, the
// transport loses no message, and reachable_again() covers outages. The receiver of a large message
// also takes long to acknowledge it.
constexpr double kRepeatedBps = 50e3;

// No solver sends messages this far ahead of those that were taken.
constexpr std::uint32_t kFarAhead = 10000;

}  // namespace

ReliableMessage ReliableChannel::write(SolverMessage message, double now_s) {
  Correspondent& to = correspondents_[message.to];
  ReliableMessage written{.sender = self_,
                          .session = session_,
                          .number = to.written++,
                          .to = message.to,
                          .bytes = std::move(message.bytes),
                          .received = to.taken};
  to.owes_acknowledgement = false;
  to.waiting.push_back({written, now_s});
  return written;
}

ReliableArrival ReliableChannel::read(const ReliableMessage& message, double now_s) {
  Correspondent& from = correspondents_[message.sender.robot];
  if (message.received > from.written) return ReliableArrival::kFalse;
  while (!from.waiting.empty() && from.waiting.front().message.number < message.received) {
    const Waiting& arrived = from.waiting.front();
    if (arrived.repetitions == 0) {
      const double took_s = now_s - arrived.sent_s;
      from.answer_s =
          from.answer_s ? *from.answer_s + (took_s - *from.answer_s) / kMeanOver : took_s;
    }
    from.waiting.pop_front();
  }
  if (!message.bytes || message.bytes->empty()) return ReliableArrival::kNone;
  const bool repeated = message.number < from.taken || from.taken_early.contains(message.number);
  if (repeated) {
    from.owes_acknowledgement = true;
    return ReliableArrival::kNone;
  }
  return message.number - from.taken > kFarAhead ? ReliableArrival::kFalse : ReliableArrival::kNew;
}

void ReliableChannel::take(const ReliableMessage& message) {
  Correspondent& from = correspondents_[message.sender.robot];
  from.taken_early.insert(message.number);
  while (!from.taken_early.empty() && *from.taken_early.begin() == from.taken) {
    from.taken_early.erase(from.taken_early.begin());
    ++from.taken;
  }
}

double ReliableChannel::patience_s(const Correspondent& of, const Waiting& waiting) const {
  const double first_s = of.answer_s ? kPatience * *of.answer_s : period_s_;
  const double least_s = kLeastPatience * period_s_;
  const double most_s = kMostPatience * period_s_;
  const double of_size_s = static_cast<double>(waiting.message.bytes->size()) / kRepeatedBps;
  return std::max(
      std::min(std::max(first_s, least_s) * std::ldexp(1.0, waiting.repetitions), most_s),
      of_size_s);
}

std::vector<ReliableMessage> ReliableChannel::due(double now_s) {
  std::vector<ReliableMessage> due;
  for (auto& [robot, of] : correspondents_) {
    for (Waiting& waiting : of.waiting) {
      if (now_s - waiting.sent_s < patience_s(of, waiting)) continue;
      waiting.sent_s = now_s;
      waiting.repetitions = std::min(waiting.repetitions + 1, 16);
      waiting.message.received = of.taken;
      of.owes_acknowledgement = false;
      due.push_back(waiting.message);
    }
    if (!std::exchange(of.owes_acknowledgement, false)) continue;
    due.push_back({.sender = self_,
                   .session = session_,
                   .number = of.written,
                   .to = robot,
                   .bytes = nullptr,
                   .received = of.taken});
  }
  return due;
}

void ReliableChannel::reachable_again(RobotId robot) {
  const auto of = correspondents_.find(robot);
  if (of == correspondents_.end()) return;
  for (Waiting& waiting : of->second.waiting)
    waiting.sent_s = -std::numeric_limits<double>::infinity();
}

}  // namespace km
