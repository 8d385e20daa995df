#include "apps/lab/simulation/motion/steady_rotations.hpp"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <optional>

#include "modules/core/lie.hpp"

namespace km {
namespace {

using SparseMatrix = Eigen::SparseMatrix<double>;
using Excess = std::vector<std::optional<Eigen::Vector3d>>;

// Rotation of the body since the first inertial sample, by a gyroscope without bias.
class Turns {
 public:
  Turns(std::span<const ImuSample> imu, const Eigen::Vector3d& bias) {
    for (std::size_t k = 0; k < imu.size(); ++k) {
      State next{imu[k].stamp, Eigen::Matrix3d::Identity(), 0};
      if (k > 0) {
        const double dt = seconds_between(imu[k - 1].stamp, imu[k].stamp);
        const Eigen::Vector3d rate = 0.5 * (imu[k - 1].gyro + imu[k].gyro) - bias;
        next.R = states_.back().R * so3_exp(dt * rate);
        next.gaps = states_.back().gaps + (dt > kMaxStep_s ? 1 : 0);
      }
      states_.push_back(next);
    }
  }

  // Rotation from one instant to another; nullopt if the samples do not span it.
  [[nodiscard]] std::optional<Eigen::Matrix3d> between(Stamp from, Stamp to) const {
    if (states_.size() < 2 || from < states_.front().stamp || to > states_.back().stamp)
      return std::nullopt;
    const auto a = at(from), b = at(to);
    if (!a || !b || a->gaps != b->gaps) return std::nullopt;
    return a->R.transpose() * b->R;
  }

 private:
  static constexpr double kMaxStep_s = 0.05;

  struct State {
    Stamp stamp = 0;
    Eigen::Matrix3d R;
    int gaps = 0;  // number of gaps in the samples before this one
  };

  // Nullopt within a gap of the samples.
  [[nodiscard]] std::optional<State> at(Stamp stamp) const {
    const auto after = std::lower_bound(states_.begin() + 1, states_.end() - 1, stamp,
                                        [](const State& s, Stamp t) { return s.stamp < t; });
    const State &a = *(after - 1), &b = *after;
    if (stamp == b.stamp) return b;
    if (a.gaps != b.gaps) return std::nullopt;
    const double u = seconds_between(a.stamp, stamp) / seconds_between(a.stamp, b.stamp);
    return State{stamp, a.R * so3_exp(u * so3_log(a.R.transpose() * b.R)), b.gaps};
  }

  std::vector<State> states_;
};

// w_k; nullopt in gaps of the gyroscope.
Excess excess_turns(std::span<const StampedPose> poses, std::span<const ImuSample> imu,
                    const Eigen::Vector3d& bias) {
  const Turns turns(imu, bias);
  Excess excess;
  for (std::size_t k = 0; k + 1 < poses.size(); ++k) {
    excess.emplace_back();
    if (const auto G = turns.between(poses[k].stamp, poses[k + 1].stamp))
      excess.back() = so3_log(poses[k + 1].T.linear() * (poses[k].T.linear() * *G).transpose());
  }
  return excess;
}

// Mean difference between the turns of the poses and those of the gyroscope, in the body frame:
// minus the bias.
Eigen::Vector3d mean_bias(std::span<const StampedPose> poses, std::span<const ImuSample> imu) {
  const auto excess = excess_turns(poses, imu, Eigen::Vector3d::Zero());
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double span_s = 0.0;
  for (std::size_t k = 0; k < excess.size(); ++k) {
    if (!excess[k]) continue;
    sum -= poses[k].T.linear().transpose() * *excess[k];
    span_s += seconds_between(poses[k].stamp, poses[k + 1].stamp);
  }
  return span_s > 0.0 ? Eigen::Vector3d(sum / span_s) : Eigen::Vector3d::Zero();
}

// Normal equations of the second sum of steady_rotations(), which do not change with the weights.
struct NormalEquations {
  SparseMatrix matrix;
  Eigen::MatrixX3d right;
};

NormalEquations equations_of(std::span<const StampedPose> poses, const Excess& excess,
                             double gyro_noise) {
  const auto n = static_cast<Eigen::Index>(poses.size());
  NormalEquations equations{{n, n}, Eigen::MatrixX3d::Zero(n, 3)};
  std::vector<Eigen::Triplet<double>> entries;
  for (Eigen::Index k = 0; k + 1 < n; ++k) {
    const auto i = static_cast<std::size_t>(k);
    if (!excess[i]) continue;
    const double weight =
        1.0 / (gyro_noise * gyro_noise * seconds_between(poses[i].stamp, poses[i + 1].stamp));
    for (const Eigen::Index row : {k, k + 1})
      for (const Eigen::Index column : {k, k + 1})
        entries.emplace_back(row, column, row == column ? weight : -weight);
    equations.right.row(k) += weight * excess[i]->transpose();
    equations.right.row(k + 1) -= weight * excess[i]->transpose();
  }
  equations.matrix.setFromTriplets(entries.begin(), entries.end());
  return equations;
}

}  // namespace

SteadiedPoses steady_rotations(std::span<const StampedPose> poses, std::span<const ImuSample> imu,
                               double noise_rad, double gyro_noise) {
  constexpr int kReweightings = 10;
  SteadiedPoses result{{poses.begin(), poses.end()}};
  if (poses.size() < 2) return result;
  result.gyro_bias_radps = mean_bias(poses, imu);
  const auto excess = excess_turns(poses, imu, result.gyro_bias_radps);

  const NormalEquations joints = equations_of(poses, excess, gyro_noise);
  Eigen::MatrixX3d turns = Eigen::MatrixX3d::Zero(joints.right.rows(), 3);
  Eigen::SimplicialLDLT<SparseMatrix> solver;
  for (int step = 0; step < kReweightings; ++step) {
    const Eigen::VectorXd weights =  // Cauchy's
        (noise_rad * noise_rad + turns.rowwise().squaredNorm().array()).inverse();
    const SparseMatrix normal = joints.matrix + SparseMatrix(weights.asDiagonal());
    if (step == 0) solver.analyzePattern(normal);
    solver.factorize(normal);
    turns = solver.solve(joints.right);
  }

  for (std::size_t k = 0; k < poses.size(); ++k)
    result.poses[k].T.linear() =
        so3_exp(turns.row(static_cast<Eigen::Index>(k))) * poses[k].T.linear();
  const Eigen::VectorXd angles = turns.rowwise().norm();
  result.rms_rad = std::sqrt(angles.squaredNorm() / static_cast<double>(poses.size()));
  result.max_rad = angles.maxCoeff();
  return result;
}

}  // namespace km
