#include "modules/pose_graph/newton/newton_agent.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace km {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr double kShorten = 0.25;
constexpr double kRounding = 1e-13;  // of the cost: a smaller increase is none

}  // namespace

NewtonAgent::NewtonAgent(RobotEdges edges, std::set<RobotId> team, int dimension,
                         const NewtonOptions& options, std::vector<SE3> start)
    : edges_(std::move(edges)),
      team_(std::move(team)),
      dimension_(dimension),
      options_(options),
      round_(options.first_round),
      accepted_(std::move(start)) {
  team_.insert(edges_.self);
  if (!accepted_.empty() && static_cast<Index>(accepted_.size()) != edges_.poses)
    throw std::invalid_argument("NewtonAgent of robot " + std::to_string(edges_.self) + ": " +
                                std::to_string(accepted_.size()) + " start poses for " +
                                std::to_string(edges_.poses));
  if (accepted_.empty() && options_.upright)
    throw std::invalid_argument("NewtonAgent of robot " + std::to_string(edges_.self) +
                                ": without start poses nothing is upright");
}

NewtonHello NewtonAgent::hello() const {
  NewtonHello hello{.robot = edges_.self, .links = links_of(edges_)};
  std::set<KeyframeIndex> poses;
  for (const auto& [peer, list] : edges_.to)
    for (const InterEdge& e : list) poses.insert(e.own);
  hello.poses.assign(poses.begin(), poses.end());
  if (!accepted_.empty())
    for (const KeyframeIndex k : poses) hello.T_world_pose.push_back(accepted_[k]);
  return hello;
}

void NewtonAgent::receive(const NewtonHello& hello) {
  if (team_.contains(hello.robot)) hellos_.try_emplace(hello.robot, hello);
}

void NewtonAgent::receive(std::shared_ptr<const NewtonShare> share) {
  if (done() || share->round < round_ || !team_.contains(share->robot)) return;
  shares_[share->round].try_emplace(share->robot, std::move(share));
}

void NewtonAgent::leave(RobotId robot) {
  if (team_.contains(robot)) phase_ = Phase::kDone;
}

bool NewtonAgent::ready() const {
  if (done()) return false;
  if (phase_ == Phase::kHello) return hellos_.size() == team_.size();
  const auto shares = shares_.find(round_);
  return shares != shares_.end() && shares->second.size() == team_.size();
}

std::optional<NewtonShare> NewtonAgent::advance() {
  if (!ready()) return std::nullopt;
  std::optional<NewtonShare> share;
  switch (phase_) {
    case Phase::kHello:
      meet();
      phase_ = accepted_.empty() ? Phase::kRotations : Phase::kDescent;
      share = accepted_.empty() ? rotation_share() : newton_share(Elimination::kGaussNewton);
      break;
    case Phase::kRotations:
      share = set_rotations();
      phase_ = Phase::kTranslations;
      break;
    case Phase::kTranslations:
      share = set_translations();
      phase_ = Phase::kDescent;
      break;
    case Phase::kDescent:
      share = descend();
      break;
    case Phase::kDone:
      break;
  }
  shares_.erase(round_);
  ++round_;
  if (share) share->round = round_;
  return share;
}

void NewtonAgent::meet() {
  std::vector<PublicLink> links;
  for (const auto& [robot, hello] : hellos_)
    links.insert(links.end(), hello.links.begin(), hello.links.end());
  if (team_.size() > 1 && links.empty())
    throw std::runtime_error("NewtonAgent: no edge joins two robots of the team");
  graph_.emplace(edges_, cover_links(links));
  factor_.emplace(graph_->plan());
  nodes_.assign(static_cast<std::size_t>(graph_->nodes()), SE3::Identity());
  if (accepted_.empty()) return;
  for (std::size_t v = 0; v < nodes_.size(); ++v)
    nodes_[v] = told_pose(graph_->id(static_cast<int>(v)));
}

SE3 NewtonAgent::told_pose(const KeyframeId& id) const {
  if (id.robot == edges_.self) return accepted_[id.index];
  const auto hello = hellos_.find(id.robot);
  if (hello != hellos_.end() && hello->second.T_world_pose.size() == hello->second.poses.size()) {
    const auto& poses = hello->second.poses;
    const auto found = std::lower_bound(poses.begin(), poses.end(), id.index);
    if (found != poses.end() && *found == id.index)
      return hello->second.T_world_pose[static_cast<std::size_t>(found - poses.begin())];
  }
  throw std::invalid_argument("NewtonAgent: nobody told pose " + to_string(id));
}

void NewtonAgent::learn_separators() {
  const std::vector<KeyframeId>& separators = separator_system_.separators();
  for (const KeyframeId& id : graph_->kept())
    place_of_kept_.push_back(static_cast<int>(
        std::lower_bound(separators.begin(), separators.end(), id) - separators.begin()));
  for (std::size_t s = 0; s < separators.size(); ++s)
    if (is_public(separators[s])) public_separators_.push_back(static_cast<Index>(s));
  separator_poses_.assign(public_separators_.size(), SE3::Identity());
  if (accepted_.empty()) return;
  for (std::size_t k = 0; k < public_separators_.size(); ++k)
    separator_poses_[k] = told_pose(separators[static_cast<std::size_t>(public_separators_[k])]);
}

bool NewtonAgent::is_public(const KeyframeId& id) const {
  const auto hello = hellos_.find(id.robot);
  return hello != hellos_.end() &&
         std::binary_search(hello->second.poses.begin(), hello->second.poses.end(), id.index);
}

void NewtonAgent::factorise_own(const RobotSystem& system) {
  if (!factor_->factorise(system.A))
    throw std::runtime_error("NewtonAgent: poses of robot " + std::to_string(edges_.self) +
                             " hang together with no separator");
}

NewtonShare NewtonAgent::share_of(const RobotSystem& system, bool with_schur) {
  NewtonShare share{.robot = edges_.self, .cost = system.cost};
  if (with_schur) share.schur = factor_->schur();
  if (with_schur && !pattern_sent_) {
    share.kept = graph_->kept();
    share.pairs = graph_->plan()->kept_pairs();
    pattern_sent_ = true;
  }
  forwarded_ = system.C;
  factor_->forward(forwarded_);
  const Index block = share.block = forwarded_.rows() / graph_->nodes();
  const auto& kept = graph_->plan()->kept();
  share.reduced.resize(block * static_cast<Index>(kept.size()), forwarded_.cols());
  for (std::size_t k = 0; k < kept.size(); ++k)
    share.reduced.middleRows(block * static_cast<Index>(k), block) =
        forwarded_.middleRows(block * kept[k], block);
  // Not the whole norm less that of the kept rows: they are large where only the team's sum is
  // small, and what rounding left of the difference would be taken for a decrease to come.
  const std::vector<int>& place = graph_->plan()->place_of_kept();
  for (std::size_t v = 0; v < place.size(); ++v)
    if (place[v] < 0)
      share.decrement += forwarded_.middleRows(block * static_cast<Index>(v), block).squaredNorm();
  return share;
}

NewtonShare NewtonAgent::newton_share(Elimination elimination) {
  if (elimination == Elimination::kReuse)
    return share_of(newton_slope(*graph_, nodes_, dimension_), false);
  last_decrement_.reset();
  all_gauss_newton_ = elimination == Elimination::kGaussNewton;
  if (elimination == Elimination::kFull) {
    const RobotSystem system = eliminated_system(*graph_, nodes_, dimension_, Curvature::kFull);
    if (factor_->factorise(system.A)) return with_kept_edges(system, Curvature::kFull);
  }
  const RobotSystem system =
      eliminated_system(*graph_, nodes_, dimension_, Curvature::kGaussNewton);
  factorise_own(system);
  return with_kept_edges(system, Curvature::kGaussNewton);
}

NewtonShare NewtonAgent::with_kept_edges(const RobotSystem& system, Curvature curvature) {
  NewtonShare share = share_of(system, true);
  share.curvature = curvature;
  share.edges = kept_edges(*graph_, nodes_);
  return share;
}

MatrixXd NewtonAgent::substitute_back(const MatrixXd& separators) const {
  MatrixXd X = forwarded_;
  const Index block = X.rows() / graph_->nodes();
  const auto& kept = graph_->plan()->kept();
  for (std::size_t k = 0; k < kept.size(); ++k)
    X.middleRows(block * kept[k], block) = separators.middleRows(block * place_of_kept_[k], block);
  factor_->backward(X);
  return X;
}

void NewtonAgent::factorise_separators() {
  if (!separator_system_.factorise(shares_.at(round_)))
    throw std::runtime_error("NewtonAgent: the graph of the team is not connected");
  if (place_of_kept_.empty()) learn_separators();
}

std::optional<NewtonShare> NewtonAgent::descend() {
  const NewtonShares& shares = shares_.at(round_);
  double cost = 0.0;
  for (const auto& [robot, share] : shares) cost += share->cost;
  if (cost_ && !(cost <= *cost_ * (1.0 + kRounding))) return go_back();
  accepted_.assign(nodes_.begin(), nodes_.begin() + edges_.poses);
  cost_ = cost;
  backtracks_ = 0;
  if (shares.begin()->second->schur.block() > 0) {
    if (all_gauss_newton_)
      factorise_separators();
    else if (!separator_system_.factorise(shares))  // no robot's part was indefinite, but the sum
      return newton_share(Elimination::kGaussNewton);
    stale_ = false;
  } else {
    stale_ = true;
  }
  const MatrixXd given = MatrixXd::Zero(tangent_size(dimension_), 1);
  const SeparatorSystem::Solution solution = options_.upright
                                                 ? separator_system_.solve_upright(shares)
                                                 : separator_system_.solve(shares, given);
  decrement_ = solution.decrement;
  if (0.5 * solution.decrement <= options_.tolerance * cost + options_.absolute_tolerance) {
    phase_ = Phase::kDone;
    return std::nullopt;
  }
  if (worth_refreshing(solution.decrement)) return newton_share(Elimination::kFull);
  base_nodes_ = nodes_;
  base_separators_ = separator_poses_;
  step_ = make_step(solution.x);
  take_step(1.0);
  return newton_share(Elimination::kReuse);
}

std::optional<NewtonShare> NewtonAgent::go_back() {
  if (++backtracks_ > options_.max_backtracks) {
    phase_ = Phase::kDone;
    return std::nullopt;
  }
  if (!stale_) {
    take_step(std::pow(kShorten, backtracks_));
    return newton_share(Elimination::kReuse);
  }
  nodes_ = base_nodes_;
  separator_poses_ = base_separators_;
  return newton_share(Elimination::kFull);
}

TeamStep NewtonAgent::make_step(const MatrixXd& separators) const {
  const Index block = tangent_size(dimension_);
  TeamStep step;
  step.separators =
      separators.reshaped(block, separators.rows() / block)(Eigen::all, public_separators_);
  step.nodes = substitute_back(separators).reshaped(block, graph_->nodes());
  remove_drift(step, nodes_, separator_poses_, options_.upright);
  return step;
}

void NewtonAgent::take_step(double scale) {
  nodes_ = moved(base_nodes_, step_.nodes, scale);
  separator_poses_ = moved(base_separators_, step_.separators, scale);
}

bool NewtonAgent::worth_refreshing(double decrement) {
  const std::optional<double> before = std::exchange(last_decrement_, decrement);
  if (!before) return false;
  const double rate = decrement / *before;
  if (!(rate < 1.0)) return true;
  const double left = std::log(decrement / (2.0 * options_.tolerance * *cost_)) / -std::log(rate);
  return left > options_.patience_rounds;
}

}  // namespace km
