#include "modules/pose_graph/robust/gnc_agent.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

namespace km {
namespace {

using Eigen::Index;

constexpr double kShorten = 0.25;
constexpr double kRounding = 1e-13;  // of the cost: a smaller increase is none
constexpr int kMaxBacktracks = 8;
// Of the residual: what conjugate gradients, where they are needed, have to reach.
constexpr double kAccuracy = 0.1;
constexpr double kFinalAccuracy = 1e-3;
constexpr double kNegligible = 1e-9;     // [sigma^2], of the whole team's cost
constexpr double kPatienceRounds = 8.0;  // see NewtonOptions

}  // namespace

void GncAgent::receive(const GncHello& hello) {
  if (team_.contains(hello.robot)) hellos_.try_emplace(hello.robot, hello);
}

void GncAgent::receive(std::shared_ptr<const GncShare> share) {
  if (done() || share->round < round_ || !team_.contains(share->robot)) return;
  shares_[share->round].try_emplace(share->robot, std::move(share));
}

void GncAgent::leave(RobotId robot) {
  if (team_.contains(robot)) phase_ = Phase::kDone;
}

bool GncAgent::ready() const {
  if (done()) return false;
  if (phase_ == Phase::kHello) return hellos_.size() == team_.size();
  const auto shares = shares_.find(round_);
  return shares != shares_.end() && shares->second.size() == team_.size();
}

std::optional<GncShare> GncAgent::advance() {
  if (!ready()) return std::nullopt;
  std::optional<GncShare> next;
  if (phase_ == Phase::kHello) {
    meet();
    phase_ = Phase::kRounds;
    next = share(true);
  } else {
    for (const auto& [robot, told] : shares_.at(round_))
      if (told->schur.block() > 0) system_->set_part(robot, told->schur);
    next = step_on();
  }
  shares_.erase(round_);
  ++round_;
  if (next) next->round = round_;
  return next;
}

GncShare GncAgent::share(bool fresh) {
  decided_told_ = schedule_->decided();
  const bool full = decided_told_ && !convex_;
  fresh = fresh || (full && !full_told_) || block_.stale();
  std::optional<Curvature> curvature;
  if (fresh) curvature = full ? Curvature::kFull : Curvature::kGaussNewton;
  full_told_ = full;
  GncShare share = block_.share(candidate_.own, curvature);
  share.base_cost = told_cost(base_);
  share.cost = told_cost(candidate_);
  share.residuals = inside_residuals(candidate_.own);
  return share;
}

// Of its own edges and of those to robots with higher ids: from these numbers all decide alike.
double GncAgent::told_cost(const Poses& poses) const {
  const std::vector<double> residuals = graph_->residuals(poses.all_public);
  double cost = block_.cost(poses.own);
  for (std::size_t k = 0; k < residuals.size(); ++k)
    if (graph_->links()[k].a == edges_.edges.self)
      cost += link_weights_[k] * residuals[k] * residuals[k];
  return cost;
}

std::optional<GncShare> GncAgent::step_on() {
  double base_cost = 0.0, cost = 0.0;
  std::vector<float> inside;
  for (const auto& [robot, told] : shares_.at(round_)) {
    base_cost += told->base_cost;
    cost += told->cost;
    inside.insert(inside.end(), told->residuals.begin(), told->residuals.end());
  }
  if (!at_base_ && !(cost <= base_cost * (1.0 + kRounding) + kNegligible)) return go_back();
  if (!at_base_) retried_ = false;
  base_ = candidate_;
  cost_ = cost;
  backtracks_ = 0;
  const bool final_weights = decided_told_;
  if (all_in_ > 0)
    --all_in_;
  else if (!schedule_->decided() && !std::exchange(hold_weights_, false))
    update_weights(inside);
  at_base_ = false;
  const std::optional<PublicSystem::Solution> solution = solve();
  if (!solution) {
    convex_ = true;
    return share_at_base();
  }
  decrement_ = solution->decrement;
  if (final_weights) {
    if (0.5 * decrement_ <= options_.tolerance * cost + kNegligible) {
      phase_ = Phase::kDone;
      return std::nullopt;
    }
    if (worth_refreshing(decrement_, cost)) {
      convex_ = false;
      return share_at_base();
    }
  }
  const Index first = graph_->first(edges_.edges.self);
  step_ = {.nodes = block_.substitute_back(
               solution->x.middleCols(first, graph_->sizes().at(edges_.edges.self))),
           .separators = solution->x};
  remove_drift(step_, base_.own, base_.all_public, false);
  take_step(1.0);
  return share(false);
}

// nullopt if full second derivatives, far from the optimum, are indefinite: all find so alike.
std::optional<PublicSystem::Solution> GncAgent::solve() {
  if (!system_->factorise(base_.all_public, link_weights_,
                          full_told_ ? Curvature::kFull : Curvature::kGaussNewton)) {
    if (full_told_) return std::nullopt;
    throw std::runtime_error("GncAgent: the graph of the team is not connected");
  }
  const Index block = tangent_size(dimension_);
  Eigen::VectorXd reduced = Eigen::VectorXd::Zero(block * graph_->nodes());
  double decrement = 0.0;
  for (const auto& [robot, told] : shares_.at(round_)) {
    const Index size = block * graph_->sizes().at(robot);
    if (told->reduced.size() != size)
      throw std::invalid_argument("GncAgent: robot " + std::to_string(robot) + " told " +
                                  std::to_string(told->reduced.size()) + " right-hand sides of " +
                                  std::to_string(size));
    reduced.segment(block * graph_->first(robot), size) = told->reduced;
    decrement += told->decrement;
  }
  PublicSystem::Solution solution =
      system_->solve(reduced, decided_told_ ? kFinalAccuracy : kAccuracy);
  solution.decrement += decrement;
  return solution;
}

void GncAgent::take_step(double scale) {
  candidate_ = {moved(base_.own, step_.nodes, scale),
                moved(base_.all_public, step_.separators, scale)};
}

std::optional<GncShare> GncAgent::go_back() {
  ++backtracks_;
  if (backtracks_ > kMaxBacktracks) {
    if (decided_told_) {
      phase_ = Phase::kDone;
      return std::nullopt;
    }
    retried_ = false;
    return share_at_base();  // with the next weights, the next step may succeed
  }
  if (backtracks_ == 2 && !retried_) {
    hold_weights_ = retried_ = true;
    return share_at_base();
  }
  take_step(std::pow(kShorten, backtracks_));
  return share(false);
}

GncShare GncAgent::share_at_base() {
  candidate_ = base_;
  at_base_ = true;
  last_decrement_.reset();
  return share(true);
}

bool GncAgent::worth_refreshing(double decrement, double cost) {
  const std::optional<double> before = std::exchange(last_decrement_, decrement);
  if (!before) return false;
  const double rate = decrement / *before;
  if (!(rate < 1.0)) return true;
  const double left = std::log(decrement / (2.0 * options_.tolerance * cost)) / -std::log(rate);
  return left > kPatienceRounds;
}

}  // namespace km
