#include "modules/recorded_graph/g2o_io.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <unordered_set>

#include "modules/core/data/measurement_limits.hpp"
#include "modules/core/geometry/lie.hpp"
#include "modules/core/io/input_file.hpp"
#include "modules/core/io/write_file.hpp"
#include "modules/recorded_graph/text_fields.hpp"

namespace km {
namespace {

constexpr std::uint64_t kLetters = 26;
// Tolerance of the information of a prior, relative to 1 / sigma^2.
constexpr double kVerticalTolerance = 1e-3;

KeyframeId read_id(TextFields& fields) {
  const std::uint64_t key = fields.integer("vertex id");
  const auto id = keyframe_of_key(key);
  if (!id) fields.fail("vertex id " + std::to_string(key) + " names no robot and index");
  return *id;
}

// Angles may contain full turns. Larger angles are not precise enough.
constexpr Bounds<double> kAngle_rad{-1e6, 1e6};

SE3 read_pose(TextFields& fields, int dimension, const Bounds<double>& bounds_m) {
  Eigen::Vector3d t = Eigen::Vector3d::Zero();
  for (int i = 0; i < dimension; ++i) t(i) = fields.number("translation", bounds_m);
  if (dimension == 2) {
    const Eigen::AngleAxisd R(fields.number("angle", kAngle_rad), Eigen::Vector3d::UnitZ());
    return make_pose(R.toRotationMatrix(), t);
  }
  return make_pose(fields.rotation(), t);
}

// Upper triangle of an NxN information matrix.
template <int N>
Eigen::Matrix<double, N, N> read_information(TextFields& fields) {
  Eigen::Matrix<double, N, N> information;
  for (int r = 0; r < N; ++r)
    for (int c = r; c < N; ++c)
      information(r, c) = information(c, r) = fields.number("information");
  return information;
}

// Weight that SE-Sync gives to a block of an information matrix: 1 / (mean of the eigenvalues of
// the inverse). See usable().
template <typename Block>
double mean_precision(const Block& information) {
  return static_cast<double>(information.rows()) / information.inverse().trace();
}

// False for the weights of blocks that are singular, or whose inverse has a negative trace.
bool usable(double weight) {
  return weight > 0.0 && std::isfinite(weight);
}

std::string shown(double weight) {
  return std::isfinite(weight) ? std::to_string(weight) : "0: they are singular";
}

// Covariance of an edge, in the order of the file.
template <int N>
struct EdgeCovariance {
  Eigen::Matrix<double, N, N> Sigma;
  bool definite = true;  // the information matrix is positive definite
};

// Covariance without cross terms that has the weights of SE-Sync for the blocks of `information`.
template <int N>
EdgeCovariance<N> covariance_of_blocks(const Eigen::Matrix<double, N, N>& information,
                                       const TextFields& fields) {
  constexpr int kAxes = N == 6 ? 3 : 2;
  constexpr int kTurns = N - kAxes;
  const double tau = mean_precision(information.template topLeftCorner<kAxes, kAxes>().eval());
  const double rotation =  // 2 kappa; in the plane kappa
      mean_precision(information.template bottomRightCorner<kTurns, kTurns>().eval());
  if (!usable(tau) || !usable(rotation))
    fields.fail("information matrix is not positive definite, and its blocks weigh rotation by " +
                shown(rotation) + " and translation by " + shown(tau));
  Eigen::Matrix<double, N, 1> variances;
  variances.template head<kAxes>().setConstant(1.0 / tau);
  variances.template tail<kTurns>().setConstant(1.0 / rotation);
  return {variances.asDiagonal(), false};
}

template <int N>
EdgeCovariance<N> read_covariance(TextFields& fields) {
  const Eigen::Matrix<double, N, N> information = read_information<N>(fields);
  if (!fields.at_end())
    fields.fail("information matrix has more than the " + std::to_string(N * (N + 1) / 2) +
                " numbers of its upper triangle");
  const Eigen::LLT<Eigen::Matrix<double, N, N>> llt(information);
  EdgeCovariance<N> edge =
      llt.info() != Eigen::Success
          ? covariance_of_blocks<N>(information, fields)
          : EdgeCovariance<N>{llt.solve(Eigen::Matrix<double, N, N>::Identity())};
  for (const double variance : edge.Sigma.diagonal())
    if (!kAxisVariance.contains(variance))
      fields.fail("information matrix: its inverse has a variance of " + shortest_text(variance) +
                  ", outside " + kAxisVariance.text());
  return edge;
}

// Information of the prior of a vertical, [translation; rotation], in units of 1 / sigma^2.
Matrix6 tilt_information(const Eigen::Vector3d& up) {
  Matrix6 information = Matrix6::Zero();
  information.bottomRightCorner<3, 3>() = Eigen::Matrix3d::Identity() - up * up.transpose();
  return information;
}

// Exchanges [translation; rotation] and [rotation; translation].
Matrix6 swap_blocks(const Matrix6& M) {
  Matrix6 swapped;
  swapped << M.bottomRightCorner<3, 3>(), M.bottomLeftCorner<3, 3>(),  //
      M.topRightCorner<3, 3>(), M.topLeftCorner<3, 3>();
  return swapped;
}

// Covariance of (x, y, angle) as covariance of a pose in 3D.
Matrix6 lift(const Eigen::Matrix3d& Sigma) {
  constexpr int kPlace[] = {3, 4, 2};
  Matrix6 lifted = Matrix6::Zero();
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) lifted(kPlace[r], kPlace[c]) = Sigma(r, c);
  return lifted;
}

class Reader {
 public:
  G2oGraph graph{.dimension = 0, .vertices = {}, .edges = {}};

  void read_line(TextFields& fields) {
    const std::string_view tag = fields.text("tag");
    if (tag == "FIX") return;
    const auto read_rest = reader_of(tag);
    if (read_rest == nullptr)
      fields.fail("unknown tag '" + std::string(tag) + '\'' +
                  (tag.find(' ') != tag.npos ? "; are there decimal commas?" : ""));
    set_dimension(tag.ends_with("SE2") ? 2 : 3, fields);
    (this->*read_rest)(fields);
    if (!fields.at_end()) fields.fail("more fields than " + std::string(tag) + " has");
  }

 private:
  using ReadRest = void (Reader::*)(TextFields&);

  static ReadRest reader_of(std::string_view tag) {
    if (tag == "VERTEX_SE3:QUAT" || tag == "VERTEX_SE2") return &Reader::read_vertex;
    if (tag == "EDGE_SE3:QUAT" || tag == "EDGE_SE2") return &Reader::read_edge;
    if (tag == "PARAMS_SE3OFFSET") return &Reader::read_offset;
    if (tag == "EDGE_SE3_PRIOR") return &Reader::read_vertical;
    return nullptr;
  }

  void set_dimension(int dimension, const TextFields& fields) {
    if (graph.dimension == 0) graph.dimension = dimension;
    if (graph.dimension != dimension) fields.fail("2D and 3D in one file");
  }

  void read_vertex(TextFields& fields) {
    const KeyframeId id = read_id(fields);
    if (!seen_.insert(id).second) fields.fail("vertex " + to_string(id) + " is given twice");
    graph.vertices.push_back({id, read_pose(fields, graph.dimension, kPosition_m)});
  }

  void read_edge(TextFields& fields) {
    RelativePose& edge = graph.edges.emplace_back();
    edge.from = read_id(fields);
    edge.to = read_id(fields);
    if (edge.from == edge.to) fields.fail("edge from " + to_string(edge.from) + " to itself");
    edge.T_from_to = read_pose(fields, graph.dimension, kStep_m);
    if (graph.dimension == 2) {
      const EdgeCovariance<3> read = read_covariance<3>(fields);
      edge.covariance = lift(read.Sigma);
      graph.indefinite_edges += read.definite ? 0 : 1;
    } else {
      const EdgeCovariance<6> read = read_covariance<6>(fields);
      edge.covariance = swap_blocks(read.Sigma);
      graph.indefinite_edges += read.definite ? 0 : 1;
    }
  }

  void read_offset(TextFields& fields) {
    const std::uint64_t offset = fields.integer("offset id");
    if (!read_pose(fields, 3, kStep_m).isApprox(SE3::Identity(), kUnitTolerance))
      fields.fail("offset " + std::to_string(offset) +
                  " is not the identity: priors are read of poses, not of sensors on them");
    offsets_.insert(offset);
  }

  void read_vertical(TextFields& fields) {
    const KeyframeId id = read_id(fields);
    const std::uint64_t offset = fields.integer("offset id");
    if (!offsets_.contains(offset))
      fields.fail("no PARAMS_SE3OFFSET " + std::to_string(offset) + " before");
    const Eigen::Vector3d up = read_pose(fields, 3, kStep_m).linear().row(2);
    const Matrix6 information = read_information<6>(fields);
    const double weight = 0.5 * information.bottomRightCorner<3, 3>().trace();
    const Matrix6 error = information - weight * tilt_information(up);
    if (!(weight > 0.0) || !(error.cwiseAbs().maxCoeff() <= kVerticalTolerance * weight))
      fields.fail("prior on " + to_string(id) +
                  " is not a vertical: its information must be k (I - u u^T) on the rotation, u "
                  "the world's z axis seen from the pose, and zero on the translation");
    if (!upright_.insert(id).second) fields.fail("second prior on " + to_string(id));
    const double sigma_rad = 1.0 / std::sqrt(weight);
    if (!kTiltSigma_rad.contains(sigma_rad))
      fields.fail("prior on " + to_string(id) + ": a tilt known to " + shortest_text(sigma_rad) +
                  " rad, outside " + kTiltSigma_rad.text());
    graph.verticals.push_back({id, {up, sigma_rad}});
  }

  std::unordered_set<KeyframeId> seen_;
  std::unordered_set<KeyframeId> upright_;
  std::unordered_set<std::uint64_t> offsets_;
};

void write_pose(std::ostream& out, const SE3& T) {
  const Eigen::Quaterniond q(T.linear());
  for (const double c : T.translation()) out << ' ' << c;
  for (const double c : q.coeffs()) out << ' ' << c;
}

void write_information(std::ostream& out, const Matrix6& information) {
  for (int r = 0; r < 6; ++r)
    for (int c = r; c < 6; ++c) out << ' ' << information(r, c);
  out << '\n';
}

void write_edge(std::ostream& out, const RelativePose& edge) {
  const Eigen::LLT<Matrix6> llt(swap_blocks(edge.covariance));
  if (llt.info() != Eigen::Success)
    throw std::invalid_argument("write_g2o: covariance of edge " + to_string(edge.from) + " -> " +
                                to_string(edge.to) + " is not positive definite");
  const Matrix6 information = llt.solve(Matrix6::Identity());
  out << "EDGE_SE3:QUAT " << key_of_keyframe(edge.from) << ' ' << key_of_keyframe(edge.to);
  write_pose(out, edge.T_from_to);
  write_information(out, information);
}

void write_vertical(std::ostream& out, const G2oVertical& prior) {
  const auto& [up, sigma] = prior.vertical;
  if (!(std::abs(up.norm() - 1.0) <= kUnitTolerance) || !(sigma > 0.0) || !std::isfinite(sigma))
    throw std::invalid_argument("write_g2o: the vertical of " + to_string(prior.id) +
                                " is not a unit vector with a positive sigma");
  out << "EDGE_SE3_PRIOR " << key_of_keyframe(prior.id) << " 0";
  write_pose(out, make_pose(rotation_to_z(up), Eigen::Vector3d::Zero()));
  write_information(out, tilt_information(up.normalized()) / (sigma * sigma));
}

}  // namespace

std::optional<KeyframeId> keyframe_of_key(std::uint64_t key) {
  const auto letter = static_cast<char>(key >> 56U);
  const std::uint64_t index = letter == 0 ? key & 0xffffffffU : key & ((1ULL << 56U) - 1);
  std::uint64_t robot = 0;
  if (letter == 0)
    robot = key >> 32U;
  else if ('a' <= letter && letter <= 'z')
    robot = static_cast<std::uint64_t>(letter - 'a');
  else if ('A' <= letter && letter <= 'Z')
    robot = static_cast<std::uint64_t>(letter - 'A') + kLetters;
  else
    return std::nullopt;
  if (robot > std::numeric_limits<RobotId>::max() || index > 0xffffffffU) return std::nullopt;
  return KeyframeId{static_cast<RobotId>(robot), static_cast<std::uint32_t>(index)};
}

std::uint64_t key_of_keyframe(const KeyframeId& id) {
  const std::uint64_t robot = id.robot;
  if (robot < kLetters) return (('a' + robot) << 56U) | id.index;
  if (robot < 2 * kLetters) return (('A' + robot - kLetters) << 56U) | id.index;
  return (robot << 32U) | id.index;
}

G2oGraph parse_g2o(const std::string& text, const std::string& file) {
  constexpr std::size_t kMaxFields = 64;  // a valid line has at most 31
  Reader reader;
  RowReader rows(text, kMaxFields);
  while (const auto row = rows.next()) {
    TextFields fields(*row, file);
    reader.read_line(fields);
  }
  if (reader.graph.dimension == 0) throw std::runtime_error(file + ": no vertex and no edge");
  return std::move(reader.graph);
}

G2oGraph read_g2o(const std::filesystem::path& file) {
  return parse_g2o(read_input_file(file), file.string());
}

void write_g2o(std::ostream& out, const G2oGraph& graph) {
  if (graph.dimension != 3) throw std::invalid_argument("write_g2o: the graph is not 3D");
  const auto precision = out.precision(std::numeric_limits<double>::max_digits10);
  if (!graph.verticals.empty()) out << "PARAMS_SE3OFFSET 0 0 0 0 0 0 0 1\n";
  for (const G2oVertex& vertex : graph.vertices) {
    out << "VERTEX_SE3:QUAT " << key_of_keyframe(vertex.id);
    write_pose(out, vertex.T_world_kf);
    out << '\n';
  }
  for (const RelativePose& edge : graph.edges) write_edge(out, edge);
  for (const G2oVertical& vertical : graph.verticals) write_vertical(out, vertical);
  out.precision(precision);
}

void write_g2o(const std::filesystem::path& file, const G2oGraph& graph) {
  std::ostringstream out;
  write_g2o(out, graph);
  write_file(file, out.view());
}

}  // namespace km
