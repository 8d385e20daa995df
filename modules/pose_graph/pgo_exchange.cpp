#include <exception>
#include <utility>

#include "modules/pose_graph/pgo_agent.hpp"
#include "modules/pose_graph/rounding.hpp"

// Sessions that are solved by exchanges.

namespace km {
namespace {

// A team that has not converged after so many exchanges never will: it keeps what it has.
constexpr std::uint32_t kMaxExchanges = 1000;

}  // namespace

void PgoAgent::exchange(PgoOutput& output) {
  if (*running_->round > 0) return repeat_if_silent(output);  // until the others are there
  if (const auto robot = one_that_gave_up())
    return give_up(output, "robot " + std::to_string(*robot) + " gave up");
  const auto& solver = running_->exchange->solver;
  if (!solver && !start_solver(output)) return repeat_if_silent(output);
  if (!solver->ready()) return repeat_if_silent(output);
  advance_solver(output);
}

bool PgoAgent::start_solver(PgoOutput& output) {
  const RobotId anchor = running_->session.anchor;
  const bool member = anchor != self_.robot && running_->position_of.contains(anchor);
  const auto pose = world_of(anchor);
  if (!pose || (member && poses_in_session(anchor, 0) == nullptr)) return false;
  Exchange& exchange = *running_->exchange;
  exchange.anchor = *pose;
  std::set<RobotId> members;
  for (const auto& [robot, position] : running_->position_of) members.insert(robot);
  exchange.solver = make_session_solver(
      running_->session.method, config_.gnc_barc, std::move(exchange.edges), std::move(members),
      round_to_poses(block_->X(), exchange.anchor), running_->session.upright);
  send(exchange.solver->hello(), output);
  for (const auto& [robot, peer] : peers_)
    for (const SolverMessagePtr& message : peer.exchange)
      if (message) take_in(message);
  return true;
}

void PgoAgent::take_in(const SolverMessagePtr& message) const {
  if (running_ && running_->exchange && running_->exchange->solver &&
      message->session == running_->session.id)
    running_->exchange->solver->receive(message);
}

void PgoAgent::send(SolverContent content, PgoOutput& output) {
  const auto message = std::make_shared<const SolverMessage>(
      SolverMessage{self_, running_->session.id, running_->exchange->sent++, std::move(content)});
  running_->last_sent[slot_of(message->sequence)] = message;
  running_->moved_s = running_->sent_s = now_s_;
  take_in(message);
  if (running_->session.plan.members.size() == 1) return;
  running_->bytes[self_.robot] += approximate_bytes(*message);
  output.exchange.push_back(message);
}

void PgoAgent::advance_solver(PgoOutput& output) {
  Exchange& exchange = *running_->exchange;
  std::optional<SolverContent> next;
  try {
    next = exchange.solver->advance();
  } catch (const std::exception& e) {
    return give_up(output, e.what());
  }
  ++total_rounds_;
  ++exchange.complete;
  const SolverProgress progress = exchange.solver->progress();
  PgoSession& session = running_->session;
  session.round = exchange.complete;
  session.cost = progress.cost;
  session.gradient_norm = progress.decrement;
  if (next) send(std::move(*next), output);
  const std::uint32_t limit = session.max_rounds > 0 ? session.max_rounds : kMaxExchanges;
  if (exchange.solver->done() || exchange.complete >= limit) return adopt_solution(output);
  output.more |= exchange.solver->ready();
}

void PgoAgent::adopt_solution(PgoOutput& output) {
  const Exchange& exchange = *running_->exchange;
  const std::vector<SE3>& poses = exchange.solver->poses();
  LiftedPoses X(config_.rank, 4 * static_cast<Eigen::Index>(poses.size()));
  for (std::size_t k = 0; k < poses.size(); ++k)
    X.middleCols<4>(4 * static_cast<Eigen::Index>(k)) = lift(exchange.anchor, poses[k]);
  block_->move_to(std::move(X));
  take_verdicts(output);
  running_->round = 1;
  send_poses(rounded_public_poses(), 0.0, 0.0, output);
}

void PgoAgent::take_verdicts(PgoOutput& output) {
  ClosureVerdicts verdicts = running_->exchange->solver->verdicts();
  for (const WeighedClosure& closure : verdicts.closures) {
    if (closure.kept)
      rejected_.erase(closure.id);
    else
      rejected_.insert(closure.id);
  }
  if (!verdicts.closures.empty()) output.verdicts = std::move(verdicts);
}

void PgoAgent::give_up(PgoOutput& output, const std::string& why) {
  const PgoSession& session = running_->session;
  output.notice = "session " + std::to_string(session.id.number) + " of robot " +
                  std::to_string(session.id.coordinator.robot) + " goes on by '" +
                  to_string(PgoMethod::kRbcd) + "' instead of '" + to_string(session.method) +
                  "': " + why;
  send(SolverGivesUp(), output);  // also after another one: who has not heard that hears this
  running_->exchange.reset();
  running_->session.round = 0;
  (void)block_->round_public_poses();  // to what round 0 has told
  output.more = true;
}

std::optional<RobotId> PgoAgent::one_that_gave_up() const {
  for (const auto& [robot, position] : running_->position_of) {
    const auto peer = peers_.find(robot);
    if (peer == peers_.end()) continue;
    for (const SolverMessagePtr& message : peer->second.exchange)
      if (message && message->session == running_->session.id &&
          std::holds_alternative<SolverGivesUp>(message->content))
        return robot;
  }
  return std::nullopt;
}

}  // namespace km
