#include "apps/lab/pgo/gauss_seidel_team.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>
#include <string>

#include "modules/core/lie.hpp"

namespace km {
namespace {

// kappa |Z_j - R^T Z_i|^2 for the transposed rotations Z.
EdgeForm rotation_form(const SE3& T_i_j, double kappa) {
  const Eigen::Matrix3d I = Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d zero = Eigen::Matrix3d::Zero();
  return {kappa * I, -kappa * T_i_j.linear(), kappa * I, zero, zero};
}

// The edge's residuals at R_i exp(theta_i), t_i, to first order in theta; unknowns [theta; t].
EdgeForm pose_form(const Eigen::Matrix3d& R_i, const Eigen::Matrix3d& R_j, const PoseEdge& edge) {
  const SE3& T_i_j = edge.T_from_to;
  Eigen::Matrix<double, 12, 6> A_i = Eigen::Matrix<double, 12, 6>::Zero();
  Eigen::Matrix<double, 12, 6> A_j = A_i;
  Eigen::Matrix<double, 12, 1> b = Eigen::Matrix<double, 12, 1>::Zero();
  const Eigen::Matrix3d R_ij = T_i_j.linear();
  b.head<9>() = (R_j - R_i * R_ij).reshaped();
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Matrix3d generator = skew(Eigen::Vector3d::Unit(axis));
    A_j.col(axis).head<9>() = (R_j * generator).reshaped();
    A_i.col(axis).head<9>() = -(R_i * generator * R_ij).reshaped();
  }
  b.tail<3>() = -R_i * T_i_j.translation();
  A_j.bottomRightCorner<3, 3>().setIdentity();
  A_i.bottomRightCorner<3, 3>() = -Eigen::Matrix3d::Identity();
  A_i.bottomLeftCorner<3, 3>() = R_i * skew(T_i_j.translation());
  Eigen::Matrix<double, 12, 1> weights;
  weights << Eigen::Matrix<double, 9, 1>::Constant(edge.precision.kappa),
      Eigen::Vector3d::Constant(edge.precision.tau);
  const Eigen::Matrix<double, 6, 12> WA_i = A_i.transpose() * weights.asDiagonal();
  const Eigen::Matrix<double, 6, 12> WA_j = A_j.transpose() * weights.asDiagonal();
  return {WA_i * A_i, WA_i * A_j, WA_j * A_j, WA_i * b, WA_j * b};
}

EdgeForm reversed(const EdgeForm& form) {
  return {form.H_jj, form.H_ij.transpose(), form.H_ii, form.g_j, form.g_i};
}

// Keyframes of the robot on which edges to other robots end, ascending.
std::vector<KeyframeIndex> separators_of(const SessionGraph& part) {
  std::set<KeyframeIndex> ends;
  for (const PoseEdge& e : part.between) ends.insert(e.end_on(part.self).index);
  return {ends.begin(), ends.end()};
}

LeastSquaresBlock first_stage(const SessionGraph& part, Eigen::Index poses) {
  LeastSquaresBlock block(poses, 3, Eigen::Matrix3d::Identity().replicate(poses, 1),
                          part.self == 0);
  for (const PoseEdge& e : part.own)
    block.add_own(e.from.index, e.to.index, rotation_form(e.T_from_to, e.precision.kappa));
  for (const PoseEdge& e : part.between) {
    const KeyframeId& other = e.other(part.self);
    const EdgeForm form = rotation_form(e.T_from_to, e.precision.kappa);
    block.add_other(e.end_on(part.self).index, other.robot, other.index,
                    e.from.robot == part.self ? form : reversed(form));
  }
  return block;
}

}  // namespace

LeastSquaresBlock::LeastSquaresBlock(Eigen::Index poses, Eigen::Index width, Eigen::MatrixXd x,
                                     bool hold_first)
    : poses_(poses), width_(width), held_(hold_first ? 1 : 0), x_(std::move(x)) {}

void LeastSquaresBlock::add_own(Eigen::Index i, Eigen::Index j, const EdgeForm& form) {
  own_.push_back({i, j, form});
}

void LeastSquaresBlock::add_other(Eigen::Index own, std::size_t peer, Eigen::Index other,
                                  const EdgeForm& form) {
  others_.push_back({own, peer, other, form});
}

void LeastSquaresBlock::set_other(std::size_t peer, Eigen::Index other, const Eigen::MatrixXd& x) {
  received_[{peer, other}] = x;
}

const Eigen::MatrixXd* LeastSquaresBlock::known(const Other& edge) const {
  const auto found = received_.find({edge.peer, edge.other});
  return found == received_.end() ? nullptr : &found->second;
}

void LeastSquaresBlock::factorise() {
  std::vector<Eigen::Triplet<double>> entries;
  const auto add = [&](Eigen::Index i, Eigen::Index j, const Eigen::MatrixXd& block) {
    if (i < held_ || j < held_) return;
    for (Eigen::Index r = 0; r < width_; ++r)
      for (Eigen::Index c = 0; c < width_; ++c)
        entries.emplace_back(static_cast<int>(width_ * (i - held_) + r),
                             static_cast<int>(width_ * (j - held_) + c), block(r, c));
  };
  for (const Own& e : own_) {
    add(e.i, e.i, e.form.H_ii);
    add(e.j, e.j, e.form.H_jj);
    add(e.i, e.j, e.form.H_ij);
    add(e.j, e.i, e.form.H_ij.transpose());
  }
  for (const Other& e : others_)
    if (known(e) != nullptr) add(e.own, e.own, e.form.H_ii);
  const Eigen::Index unknowns = width_ * (poses_ - held_);
  Eigen::SparseMatrix<double> H(unknowns, unknowns);
  H.setFromTriplets(entries.begin(), entries.end());
  factor_ = std::make_unique<Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>>(H);
  const bool fixed =
      factor_->info() == Eigen::Success &&
      factor_->vectorD().minCoeff() > 1e-13 * std::max(1e-300, factor_->vectorD().maxCoeff());
  if (!fixed) throw std::invalid_argument("what is known does not fix all poses of the block");
  received_when_factorised_ = received_.size();
}

void LeastSquaresBlock::solve() {
  const Eigen::Index unknowns = width_ * (poses_ - held_);
  if (unknowns == 0) return;
  if (!factor_ || received_when_factorised_ != received_.size()) factorise();
  Eigen::MatrixXd g = Eigen::MatrixXd::Zero(width_ * poses_, x_.cols());
  for (const Own& e : own_) {
    g.middleRows(width_ * e.i, width_) += e.form.g_i;
    g.middleRows(width_ * e.j, width_) += e.form.g_j;
    if (e.i < held_) g.middleRows(width_ * e.j, width_) += e.form.H_ij.transpose() * at(e.i);
    if (e.j < held_) g.middleRows(width_ * e.i, width_) += e.form.H_ij * at(e.j);
  }
  for (const Other& e : others_)
    if (const Eigen::MatrixXd* x = known(e))
      g.middleRows(width_ * e.own, width_) += e.form.g_i + e.form.H_ij * *x;
  const Eigen::MatrixXd solution = factor_->solve(-g.bottomRows(unknowns));
  change_ =
      (solution - x_.bottomRows(unknowns)).norm() / std::sqrt(static_cast<double>(solution.size()));
  x_.bottomRows(unknowns) = solution;
}

GaussSeidelTeam::GaussSeidelTeam(const TeamGraph& graph, const std::vector<SE3>& start,
                                 const GaussSeidelOptions& options)
    : options_(options),
      neighbours_(neighbours_in(graph)),
      tree_(breadth_first_tree(neighbours_)),
      colours_(colours_of(neighbours_)) {
  for (std::size_t k = 0; k < graph.robots(); ++k) {
    SessionGraph part = part_of(graph, k);
    const Eigen::Index poses = graph.poses_of(k);
    LiftedPoses X(3, 4 * poses);
    for (Eigen::Index i = 0; i < poses; ++i)
      X.middleCols<4>(4 * i) =
          start[static_cast<std::size_t>(graph.first[k] + i)].matrix().topRows<3>();
    std::vector<KeyframeIndex> separators = separators_of(part);
    LeastSquaresBlock unknowns = first_stage(part, poses);
    robots_.push_back({std::move(part), std::move(separators), std::move(unknowns), {}, {}, X});
  }
}

int GaussSeidelTeam::step(RoundMeter& meter) {
  if (done_) return 0;
  const bool flagged = sweep_ == 0;
  const std::vector<std::size_t> turn =
      flagged ? std::vector<std::size_t>{tree_.order[turn_]} : colours_[turn_];
  for (const std::size_t k : turn) solve(k, meter);
  for (const std::size_t k : turn) send(k, meter);
  turn_ = (turn_ + 1) % (flagged ? tree_.order.size() : colours_.size());
  if (turn_ != 0) return 1;
  ++sweep_;
  if (!sweep_ended()) return 1;
  if (poses_stage_)
    done_ = true;
  else
    start_second_stage(meter);
  return 1;
}

bool GaussSeidelTeam::sweep_ended() {
  if (sweep_ >= options_.max_sweeps || robots_.size() == 1) return true;
  return sweep_ > 1 && std::all_of(robots_.begin(), robots_.end(), [&](const Robot& robot) {
           return robot.unknowns.change() <= options_.tolerance;
         });
}

void GaussSeidelTeam::solve(std::size_t k, RoundMeter& meter) {
  try {
    meter.run(k, [&] {
      robots_[k].unknowns.solve();
      update_poses(robots_[k]);
    });
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument("robot " + std::to_string(k) + ": " + error.what());
  }
}

void GaussSeidelTeam::update_poses(Robot& robot) const {
  for (Eigen::Index i = 0; i < pose_count(robot.X); ++i) {
    auto pose = robot.X.middleCols<4>(4 * i);
    const Eigen::MatrixXd x = robot.unknowns.at(i);
    if (poses_stage_) {
      pose.leftCols<3>() = robot.R[static_cast<std::size_t>(i)] * so3_exp(x.topRows<3>());
      pose.col(3) = x.bottomRows<3>();
    } else {
      pose.leftCols<3>() = nearest_rotation(x.transpose());
    }
  }
}

// The first stage sends the matrices of the relaxation, which are not rotations yet. The second
// stage sends poses.
void GaussSeidelTeam::send(std::size_t k, RoundMeter& meter) {
  const Robot& robot = robots_[k];
  SentPoses sent{robot.separators,
                 LiftedPoses::Zero(3, 4 * static_cast<Eigen::Index>(robot.separators.size()))};
  meter.run(k, [&] {
    for (std::size_t s = 0; s < sent.keyframes.size(); ++s) {
      const Eigen::Index i = sent.keyframes[s];
      auto pose = sent.X.middleCols<4>(4 * static_cast<Eigen::Index>(s));
      if (poses_stage_)
        pose = robot.X.middleCols<4>(4 * i);
      else
        pose.leftCols<3>() = robot.unknowns.at(i).transpose();
    }
    sent.X = sent.X.cast<float>().cast<double>();
  });
  meter.sent(kMessageHeader + bytes_of_poses(sent.keyframes.size(), 3));
  for (const std::size_t peer : neighbours_[k])
    meter.run(peer, [&] { receive(robots_[peer], k, sent); });
}

void GaussSeidelTeam::receive(Robot& robot, std::size_t peer, const SentPoses& sent) const {
  for (std::size_t s = 0; s < sent.keyframes.size(); ++s) {
    const auto pose = sent.X.middleCols<4>(4 * static_cast<Eigen::Index>(s));
    const KeyframeIndex i = sent.keyframes[s];
    Eigen::Matrix3d& R = robot.R_other[{static_cast<RobotId>(peer), i}];
    if (!poses_stage_) {
      robot.unknowns.set_other(peer, i, pose.leftCols<3>().transpose());
      R = nearest_rotation(pose.leftCols<3>());
      continue;
    }
    Vector6 x;
    x << so3_log(nearest_rotation(R.transpose() * pose.leftCols<3>())), pose.col(3);
    robot.unknowns.set_other(peer, i, x);
  }
}

LeastSquaresBlock GaussSeidelTeam::second_stage(std::size_t k) const {
  const Robot& robot = robots_[k];
  const auto R = [&](Eigen::Index i) { return robot.R[static_cast<std::size_t>(i)]; };
  const Eigen::Index poses = pose_count(robot.X);
  LeastSquaresBlock block(poses, 6, Eigen::VectorXd::Zero(6 * poses), k == 0);
  for (const PoseEdge& e : robot.part.own)
    block.add_own(e.from.index, e.to.index, pose_form(R(e.from.index), R(e.to.index), e));
  for (const PoseEdge& e : robot.part.between) {
    const KeyframeIndex own = e.end_on(robot.part.self).index;
    const KeyframeId& other = e.other(robot.part.self);
    const Eigen::Matrix3d& R_other = robot.R_other.at(other);
    block.add_other(
        own, other.robot, other.index,
        e.to == other ? pose_form(R(own), R_other, e) : reversed(pose_form(R_other, R(own), e)));
  }
  return block;
}

void GaussSeidelTeam::start_second_stage(RoundMeter& meter) {
  for (std::size_t k = 0; k < robots_.size(); ++k)
    meter.run(k, [&] {
      Robot& robot = robots_[k];
      for (Eigen::Index i = 0; i < pose_count(robot.X); ++i)
        robot.R.emplace_back(robot.X.middleCols<3>(4 * i));
      robot.unknowns = second_stage(k);
    });
  poses_stage_ = true;
  sweep_ = 0;
}

}  // namespace km
