#include "runtime/dds/send_budget.hpp"

#include <algorithm>

namespace km {
namespace {

// A slightly negative balance counts as no debt, because sums of doubles do not reach zero exactly.
constexpr double kNoDebt_bytes = -1e-3;

// The bucket begins empty, so that the limit also holds in the first second of a run.
std::optional<TokenBucket> limit(double per_second) {
  if (per_second <= 0.0) return std::nullopt;
  return TokenBucket(per_second, SendBudget::kBurst_s * per_second, 0.0);
}

// Messages of this priority are sent while all sent bytes are below this share of the run's total.
double share_of_run(SendPriority priority) {
  switch (priority) {
    case SendPriority::kPresence:
    case SendPriority::kClosures:
      return 1.0;
    case SendPriority::kPoses:
      return 0.95;
    case SendPriority::kVerification:
      return 0.9;
    case SendPriority::kWords:
    case SendPriority::kBacklog:
      return 0.8;
    case SendPriority::kMesh:
      break;
  }
  return 0.6;
}

}  // namespace

SendBudget::SendBudget(const BudgetConfig& config)
    : config_(checked(config)), all_(limit(config.bytes_per_s)) {
  limit_of(SendPriority::kVerification) = limit(config.verification_bytes_per_s);
  limit_of(SendPriority::kPoses) = limit(config.poses_bytes_per_s);
  limit_of(SendPriority::kWords) = limit(config.words_bytes_per_s);
  limit_of(SendPriority::kMesh) = limit(config.mesh_bytes_per_s);
}

SendBudget::Limit& SendBudget::limit_of(SendPriority priority) {
  if (priority == SendPriority::kBacklog) priority = SendPriority::kWords;
  return of_priority_[static_cast<std::size_t>(priority)];
}

std::optional<double> SendBudget::wait_s(SendPriority priority, std::uint64_t bytes,
                                         std::span<const RobotId> readers, double now_s) {
  if (priority == SendPriority::kPresence) return 0.0;
  const double total = static_cast<double>(spent_bytes_ + bytes * readers.size());
  if (config_.bytes_per_run > 0.0 && total > share_of_run(priority) * config_.bytes_per_run)
    return std::nullopt;
  double wait = 0.0;
  const auto ask = [&](TokenBucket& bucket) {
    wait = std::max(wait, bucket.wait_s(kNoDebt_bytes, now_s));
  };
  if (all_) ask(*all_);
  if (Limit& own = limit_of(priority)) ask(*own);
  for (const RobotId reader : readers)
    if (const auto peer = of_peer_.find(reader); peer != of_peer_.end()) ask(peer->second);
  return wait;
}

void SendBudget::charge(SendPriority priority, std::uint64_t bytes,
                        std::span<const RobotId> readers, double now_s) {
  const std::uint64_t total = bytes * readers.size();
  spent_bytes_ += total;
  if (all_) all_->spend(static_cast<double>(total), now_s);
  if (Limit& own = limit_of(priority)) own->spend(static_cast<double>(total), now_s);
  if (config_.peer_bytes_per_s <= 0.0) return;
  for (const RobotId reader : readers)
    of_peer_.try_emplace(reader, *limit(config_.peer_bytes_per_s))
        .first->second.spend(static_cast<double>(bytes), now_s);
}

void SendBudget::settle(std::uint64_t sent_bytes, double now_s) {
  if (sent_bytes <= spent_bytes_) return;
  if (all_) all_->spend(static_cast<double>(sent_bytes - spent_bytes_), now_s);
  spent_bytes_ = sent_bytes;
}

}  // namespace km
