#pragma once

#include <Eigen/SparseCholesky>
#include <map>
#include <memory>
#include <vector>

#include "apps/lab/pgo/team_graph.hpp"
#include "apps/lab/pgo/team_solver.hpp"

namespace km {

/// Quadratic form of one edge in its two ends x_i, x_j (w x c each):
///     x_i^T H_ii x_i + 2 x_i^T H_ij x_j + x_j^T H_jj x_j + 2 g_i^T x_i + 2 g_j^T x_j.
struct EdgeForm {
  Eigen::MatrixXd H_ii, H_ij, H_jj;  ///< w x w
  Eigen::MatrixXd g_i, g_j;          ///< w x c
};

/// One robot's part of a linear least squares problem over a pose graph. The unknowns are w rows
/// and c columns for each of its poses; the values of its neighbours are given. Used for block
/// Gauss-Seidel sweeps: each solve is exact, and the factorisation is reused.
class LeastSquaresBlock {
 public:
  /// `hold_first`: pose 0, the anchor of the team, is constant.
  LeastSquaresBlock(Eigen::Index poses, Eigen::Index width, Eigen::MatrixXd x, bool hold_first);

  void add_own(Eigen::Index i, Eigen::Index j, const EdgeForm& form);
  /// Adds an edge whose other end is pose `other` of robot `peer`. `form` has the ends (own,
  /// other).
  void add_other(Eigen::Index own, std::size_t peer, Eigen::Index other, const EdgeForm& form);

  /// Sets the values of a neighbour's pose. Edges to poses without values are left out ("flagged").
  void set_other(std::size_t peer, Eigen::Index other, const Eigen::MatrixXd& x);

  /// Solves for the own unknowns. Throws std::invalid_argument if the known values do not determine
  /// them.
  void solve();

  [[nodiscard]] Eigen::MatrixXd at(Eigen::Index pose) const {
    return x_.middleRows(width_ * pose, width_);
  }
  /// Root mean square of the entries' changes in the last solve().
  [[nodiscard]] double change() const { return change_; }

 private:
  struct Own {
    Eigen::Index i, j;
    EdgeForm form;
  };
  struct Other {
    Eigen::Index own;
    std::size_t peer;
    Eigen::Index other;
    EdgeForm form;
  };

  [[nodiscard]] const Eigen::MatrixXd* known(const Other& edge) const;
  void factorise();

  Eigen::Index poses_;
  Eigen::Index width_;
  Eigen::Index held_;  // number of constant poses at the beginning: 0 or 1
  Eigen::MatrixXd x_;  // (w n) x c
  std::vector<Own> own_;
  std::vector<Other> others_;
  std::map<std::pair<std::size_t, Eigen::Index>, Eigen::MatrixXd> received_;
  std::size_t received_when_factorised_ = 0;
  std::unique_ptr<Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>> factor_;
  double change_ = 0.0;
};

struct GaussSeidelOptions {
  int max_sweeps = 200;  ///< Limit for each of the two stages.
  /// A stage ends when no robot changes by more in a sweep (RMS). The first stage compares the
  /// entries of rotations, the second rotation vectors [rad] and positions [m].
  double tolerance = 1e-4;
};

/// Two-stage distributed Gauss-Seidel (Choudhary et al., "Distributed Mapping with Privacy and
/// Communication Constraints", IJRR 2017). The first stage solves for the rotations of the chordal
/// relaxation. The second stage is one Gauss-Newton step of the whole poses from there. Both stages
/// are linear problems, solved by block Gauss-Seidel sweeps over the robots. In the first sweep of
/// a stage robots follow a tree from robot 0, whose first pose is held. They leave out the edges to
/// robots that have not solved yet (flagged initialisation). In later sweeps robots of one colour
/// solve together. The result is the chordal initialisation improved once, not a minimum. Rank 3.
class GaussSeidelTeam : public TeamSolver {
 public:
  /// `start`: poses of the whole graph. block() uses their translations until the second stage has
  /// computed translations.
  GaussSeidelTeam(const TeamGraph& graph, const std::vector<SE3>& start,
                  const GaussSeidelOptions& options = {});

  /// Throws std::invalid_argument, naming the robot, if its own edges and those to the robots
  /// before it do not determine its poses.
  int step(RoundMeter& meter) override;
  [[nodiscard]] const LiftedPoses& block(std::size_t robot) const override {
    return robots_[robot].X;
  }

 private:
  struct Robot {
    SessionGraph part;
    std::vector<KeyframeIndex> separators;
    LeastSquaresBlock unknowns;
    std::vector<Eigen::Matrix3d> R;  // after the first stage
    std::map<KeyframeId, Eigen::Matrix3d> R_other;
    LiftedPoses X;
  };
  // Poses that one robot sends to the others.
  struct SentPoses {
    std::vector<KeyframeIndex> keyframes;
    LiftedPoses X;
  };

  void solve(std::size_t k, RoundMeter& meter);
  void send(std::size_t k, RoundMeter& meter);
  void update_poses(Robot& robot) const;
  void receive(Robot& robot, std::size_t peer, const SentPoses& sent) const;
  bool sweep_ended();
  void start_second_stage(RoundMeter& meter);
  [[nodiscard]] LeastSquaresBlock second_stage(std::size_t k) const;

  GaussSeidelOptions options_;
  TeamNeighbours neighbours_;
  TeamTree tree_;
  std::vector<std::vector<std::size_t>> colours_;
  std::vector<Robot> robots_;
  bool poses_stage_ = false;
  bool done_ = false;
  int sweep_ = 0;
  std::size_t turn_ = 0;
};

}  // namespace km
