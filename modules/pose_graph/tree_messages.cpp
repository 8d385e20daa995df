#include "modules/pose_graph/tree_messages.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "modules/core/bytes.hpp"

namespace km {
namespace {

using Eigen::Index;

constexpr std::uint8_t kUp = 1;
constexpr std::uint8_t kDown = 2;
constexpr std::size_t kMaxElements = 1U << 24U;

// Couplings are sent as whole numbers of units. A unit is this share of the geometric mean of the
// two diagonal entries. With 2^-15, three of twenty recorded graphs of 2 to 12 robots do not
// converge. With 2^-20 all of them do, but not the equations of 100 robots on a ring, whose
// weakest motions are softer than the rounding errors.
constexpr double kCouplingUnit = 0x1p-26;
constexpr double kMostUnits = 1e15;  // beyond it, a double is not a whole number of units

double unit_of(const BlockMatrix& S, const NodePair& ends, Index row, Index column) {
  return kCouplingUnit * std::sqrt(std::abs(S.at(ends[0])(row, row))) *
         std::sqrt(std::abs(S.at(ends[1])(column, column)));
}

std::int64_t in_units(double coupling, double unit) {
  if (!(unit > 0.0) || std::isnan(coupling)) return 0;
  return std::llround(std::clamp(coupling / unit, -kMostUnits, kMostUnits));
}

class TreeWriter : public ByteWriter {
 public:
  void id(const KeyframeId& k) {
    varint(k.robot);
    varint(k.index);
  }
  void single(const SinglePose& T) {
    for (const float x : T.q.coeffs()) f32(x);
    for (const float x : T.t) f32(x);
  }
  void zigzag(std::int64_t x) {
    varint((static_cast<std::uint64_t>(x) << 1U) ^ static_cast<std::uint64_t>(x >> 63U));
  }
  void doubles(const auto& values) {
    for (Index k = 0; k < values.size(); ++k) f64(values.reshaped()(k));
  }
  void singles(const Eigen::VectorXd& values) {
    varint(static_cast<std::uint64_t>(values.size()));
    for (const double x : values) f32(static_cast<float>(x));
  }
};

class TreeReader : public ByteReader {
 public:
  using ByteReader::ByteReader;
  KeyframeId id() {
    const auto robot = varint_as<RobotId>();
    return {robot, varint_as<KeyframeIndex>()};
  }
  double number() {
    const double x = f64();
    if (!std::isfinite(x)) fail();
    return x;
  }
  float small_number() {
    const float x = f32();
    if (!std::isfinite(x)) fail();
    return x;
  }
  float weight() {
    const float w = small_number();
    if (!(w >= 0.0F && w <= 1.0F)) fail();
    return w;
  }
  double coupling(double unit) {
    const std::uint64_t x = varint();
    const auto units = static_cast<std::int64_t>((x >> 1U) ^ (~(x & 1U) + 1U));
    const double coupling = static_cast<double>(units) * unit;
    if (in_units(coupling, unit) != units) fail();
    return coupling;
  }
  bool flag() {
    const std::uint8_t x = u8();
    if (x > 1) fail();
    return x == 1;
  }
  SinglePose single() {
    SinglePose T;
    for (float& x : T.q.coeffs()) x = small_number();
    for (float& x : T.t) x = small_number();
    if (std::abs(T.q.norm() - 1.0F) > 1e-3F) fail();
    return T;
  }
  Eigen::VectorXd doubles() {
    Eigen::VectorXd values(static_cast<Index>(count(kMaxElements, sizeof(double))));
    for (double& x : values) x = number();
    return values;
  }
  Eigen::VectorXd singles() {
    Eigen::VectorXd values(static_cast<Index>(count(kMaxElements, sizeof(float))));
    for (double& x : values) x = static_cast<double>(small_number());
    return values;
  }
};

bool below(const PairVote& x, const PairVote& y) {
  return std::pair(x.a, x.b) < std::pair(y.a, y.b);
}

void write(TreeWriter& w, const TreeSums& s) {
  for (const double x : {s.base_cost, s.cost, s.decrement}) w.f64(x);
  w.f32(s.largest);
  for (const std::uint32_t n :
       {s.open, s.changed, s.fractional, s.kept, s.rejected, s.isolated, s.fixed, s.poses})
    w.varint(n);
  w.varint(s.lengths.size());
  for (const auto& [bin, n] : s.lengths) {
    w.varint(bin);
    w.varint(n);
  }
  w.varint(s.votes.size());
  for (const PairVote& v : s.votes) {
    w.varint(v.a);
    w.varint(v.b);
    w.varint(v.used);
    w.single(v.motion.T);
    for (const double x : v.motion.centre) w.f64(x);
    w.f64(v.motion.radius_m);
    w.f64(v.motion.spread_m);
    w.f64(v.motion.strength.kappa);
    w.f64(v.motion.strength.tau);
    w.f32(v.noise);
  }
}

TreeSums read_sums(TreeReader& r) {
  TreeSums s;
  for (double* x : {&s.base_cost, &s.cost, &s.decrement}) *x = r.number();
  s.largest = r.small_number();
  for (std::uint32_t* n :
       {&s.open, &s.changed, &s.fractional, &s.kept, &s.rejected, &s.isolated, &s.fixed, &s.poses})
    *n = r.varint_as<std::uint32_t>();
  for (std::size_t n = r.count(kMaxElements, 2); n > 0; --n) {
    const auto bin = r.varint_as<std::uint16_t>();
    if (!s.lengths.empty() && bin <= s.lengths.rbegin()->first) r.fail();
    s.lengths[bin] = r.varint_as<std::uint32_t>();
  }
  for (std::size_t n = r.count(kMaxElements, 91); n > 0; --n) {
    PairVote v{.a = r.varint_as<RobotId>()};
    v.b = r.varint_as<RobotId>();
    if (!s.votes.empty() && !below(s.votes.back(), v)) r.fail();
    v.used = r.varint_as<std::uint32_t>();
    v.motion.T = r.single();
    for (double& x : v.motion.centre) x = r.number();
    v.motion.radius_m = r.number();
    v.motion.spread_m = r.number();
    v.motion.strength.kappa = r.number();
    v.motion.strength.tau = r.number();
    v.noise = r.small_number();
    const bool in_range = v.noise >= 0.0F && v.motion.radius_m >= 0.0 && v.motion.spread_m >= 0.0 &&
                          v.motion.strength.kappa >= 0.0 && v.motion.strength.tau >= 0.0;
    if (!in_range) r.fail();
    s.votes.push_back(v);
  }
  return s;
}

// Zero blocks are left out, for instance those of poses on which only edges in TreeSystem::edges
// end.
std::vector<bool> present_blocks(const TreeSystem& system) {
  std::vector<bool> present;
  const BlockMatrix& S = system.schur;
  for (std::size_t k = 0; k < system.variables.size(); ++k)
    present.push_back(!S.at(static_cast<int>(k)).isZero(0.0));
  for (std::size_t p = 0; p < system.pairs.size(); ++p)
    present.push_back(is_sent(S, system.pairs[p], static_cast<int>(p)));
  return present;
}

void write(TreeWriter& w, const TreeSystem& system) {
  const Index B = system.schur.block();
  w.u8(static_cast<std::uint8_t>(B));
  w.varint(system.variables.size());
  for (const TreeVariable& v : system.variables) {
    w.id(v.id);
    w.varint(v.touched);
    w.varint(v.of);
  }
  w.varint(system.pairs.size());
  for (const auto& [i, j] : system.pairs) {
    w.varint(static_cast<std::uint64_t>(i));
    w.varint(static_cast<std::uint64_t>(j));
  }
  const std::vector<bool> present = present_blocks(system);
  for (std::size_t k = 0; k < present.size(); k += 8) {
    unsigned byte = 0;
    for (std::size_t b = k; b < std::min(k + 8, present.size()); ++b)
      if (present[b]) byte |= 1U << (b - k);
    w.u8(static_cast<std::uint8_t>(byte));
  }
  const std::size_t n = system.variables.size();
  for (std::size_t k = 0; k < n; ++k)
    if (present[k])
      for (Index c = 0; c < B; ++c)
        for (Index row = c; row < B; ++row) w.f64(system.schur.at(static_cast<int>(k))(row, c));
  for (std::size_t p = 0; p < system.pairs.size(); ++p) {
    const auto values = system.schur.between(static_cast<int>(p));
    for (Index c = 0; present[n + p] && c < B; ++c)
      for (Index row = 0; row < B; ++row)
        w.zigzag(in_units(values(row, c), unit_of(system.schur, system.pairs[p], row, c)));
  }
  w.varint(system.edges.size());
  for (const SentEdge& e : system.edges) {
    const bool full = e.curvature == Curvature::kFull;
    w.varint(4 * static_cast<std::uint64_t>(e.pair) + (e.transposed ? 2U : 0U) + (full ? 1U : 0U));
    w.f32(e.kappa);
    w.f32(e.tau);
    w.f32(e.weight);
    w.single(e.present);
    if (full) w.single(e.measured);
  }
}

void read_blocks(TreeReader& r, TreeSystem& system, Index B) {
  const std::size_t n = system.variables.size();
  const std::size_t blocks = n + system.pairs.size();
  const auto bits = r.bytes((blocks + 7) / 8);
  if (r.failed()) return;
  const auto present = [&](std::size_t k) { return ((bits[k / 8] >> (k % 8)) & 1U) != 0; };
  std::size_t least = 0;
  for (std::size_t k = 0; k < blocks; ++k)
    if (present(k)) least += static_cast<std::size_t>(k < n ? 4 * B * (B + 1) : B * B);
  if (least > r.left()) {
    r.fail();
    return;
  }
  system.schur = BlockMatrix::zero(B, n, system.pairs.size());
  for (std::size_t k = 0; k < n; ++k) {
    if (!present(k)) continue;
    auto block = system.schur.at(static_cast<int>(k));
    for (Index c = 0; c < B; ++c)
      for (Index row = c; row < B; ++row) block(row, c) = block(c, row) = r.number();
  }
  for (std::size_t p = 0; p < system.pairs.size(); ++p) {
    auto values = system.schur.between(static_cast<int>(p));
    for (Index c = 0; present(n + p) && c < B; ++c)
      for (Index row = 0; row < B; ++row)
        values(row, c) = r.coupling(unit_of(system.schur, system.pairs[p], row, c));
  }
  const std::vector<bool> nonzero = present_blocks(system);  // equal systems have equal bytes
  for (std::size_t k = 0; k < 8 * bits.size(); ++k)
    if (present(k) != (k < blocks && nonzero[k])) r.fail();
}

void read_edges(TreeReader& r, TreeSystem& system) {
  for (std::size_t n = r.count(kMaxElements, 41); n > 0; --n) {
    SentEdge e;
    const std::uint64_t code = r.varint();
    if (code / 4 >= system.pairs.size()) {
      r.fail();
      return;
    }
    e.pair = static_cast<int>(code / 4);
    e.transposed = (code & 2U) != 0;
    e.curvature = (code & 1U) != 0 ? Curvature::kFull : Curvature::kGaussNewton;
    e.kappa = r.small_number();
    e.tau = r.small_number();
    if (!(e.kappa > 0.0F && e.tau > 0.0F)) r.fail();
    e.weight = r.weight();
    e.present = r.single();
    if (e.curvature == Curvature::kFull) e.measured = r.single();
    system.edges.push_back(e);
  }
}

std::optional<TreeSystem> read_system(TreeReader& r) {
  TreeSystem system;
  const Index B = r.u8();
  if (B != 3 && B != 6) r.fail();
  for (std::size_t n = r.count(kMaxElements, 4); n > 0; --n) {
    TreeVariable v{.id = r.id()};
    v.touched = r.varint_as<std::uint32_t>();
    v.of = r.varint_as<std::uint32_t>();
    system.variables.push_back(v);
  }
  const auto is_place = [&](std::uint64_t k) { return k < system.variables.size(); };
  for (std::size_t n = r.count(kMaxElements, 2); n > 0; --n) {
    const std::uint64_t i = r.varint(), j = r.varint();
    if (!is_place(i) || !is_place(j) || i == j) {
      r.fail();
      break;
    }
    system.pairs.push_back({static_cast<int>(i), static_cast<int>(j)});
  }
  read_blocks(r, system, B);
  if (!r.failed()) read_edges(r, system);
  return r.failed() ? std::nullopt : std::optional(std::move(system));
}

}  // namespace

EdgeModel SentEdge::model() const {
  const SE3 T_i_j = curvature == Curvature::kFull ? measured.pose() : present.pose();
  const auto w = static_cast<double>(weight);
  const Precision precision{w * static_cast<double>(kappa), w * static_cast<double>(tau)};
  return model_edge(T_i_j, precision, SE3::Identity(), present.pose(), curvature);
}

bool is_sent(const BlockMatrix& schur, const NodePair& ends, int pair) {
  const auto values = schur.between(pair);
  for (Index c = 0; c < values.cols(); ++c)
    for (Index row = 0; row < values.rows(); ++row)
      if (in_units(values(row, c), unit_of(schur, ends, row, c)) != 0) return true;
  return false;
}

void TreeSums::add(const TreeSums& other) {
  base_cost += other.base_cost;
  cost += other.cost;
  decrement += other.decrement;
  largest = std::max(largest, other.largest);
  open += other.open;
  changed += other.changed;
  fractional += other.fractional;
  kept += other.kept;
  rejected += other.rejected;
  isolated += other.isolated;
  fixed += other.fixed;
  poses += other.poses;
  for (const auto& [bin, n] : other.lengths) lengths[bin] += n;
  std::vector<PairVote> all;
  std::merge(votes.begin(), votes.end(), other.votes.begin(), other.votes.end(),
             std::back_inserter(all), below);
  votes.clear();
  for (const PairVote& v : all) {
    if (votes.empty() || below(votes.back(), v))
      votes.push_back(v);
    else
      votes.back().used += v.used;
  }
}

std::vector<std::uint8_t> encode(const UpMessage& message) {
  TreeWriter w;
  w.u8(kUp);
  w.varint(message.round);
  w.u8(message.failed ? 1 : 0);
  write(w, message.sums);
  w.varint(static_cast<std::uint64_t>(message.reduced.size()));
  w.doubles(message.reduced);
  w.u8(message.system ? 1 : 0);
  if (message.system) write(w, *message.system);
  w.varint(message.weights.size());
  for (const auto& [edge, weight] : message.weights) {
    w.varint(edge);
    w.f32(weight);
  }
  return w.release();
}

std::optional<UpMessage> decode_up(std::span<const std::uint8_t> bytes) {
  TreeReader r(bytes);
  if (r.u8() != kUp) return std::nullopt;
  UpMessage message{.round = r.varint_as<std::uint32_t>(), .sums = {}};
  message.failed = r.flag();
  message.sums = read_sums(r);
  message.reduced = r.doubles();
  if (r.flag()) message.system = read_system(r);
  for (std::size_t n = r.count(kMaxElements, 5); n > 0; --n) {
    const auto edge = r.varint_as<std::uint32_t>();
    message.weights.push_back({edge, r.weight()});
  }
  return r.done() ? std::optional(std::move(message)) : std::nullopt;
}

std::vector<std::uint8_t> encode(const DownMessage& message) {
  const TreeVerdict& v = message.verdict;
  TreeWriter w;
  w.u8(kDown);
  w.varint(v.round);
  w.u8(static_cast<std::uint8_t>(v.next));
  w.u8(static_cast<std::uint8_t>(v.weighing));
  w.u8(static_cast<std::uint8_t>((v.accept ? 1 : 0) + (v.full ? 2 : 0) + (v.deferred ? 4 : 0) +
                                 (v.free ? 8 : 0) + (v.weigh_all ? 16 : 0)));
  for (const double x : {v.scale, v.mu, v.barc, v.noise_scale, v.usual_noise, v.usual_pair.kappa,
                         v.usual_pair.tau, v.cost, v.gradient})
    w.f64(x);
  for (const double x : v.drift) w.f64(x);
  w.varint(v.moves.size());
  for (const auto& [robot, T] : v.moves) {
    w.varint(robot);
    w.single(T);
  }
  w.singles(message.step);
  w.varint(message.inverse.diagonal.size());
  for (const float x : message.inverse.diagonal) w.f32(x);
  w.varint(message.inverse.correlations.size());
  for (const std::int16_t x : message.inverse.correlations) w.u16(static_cast<std::uint16_t>(x));
  return w.release();
}

std::optional<DownMessage> decode_down(std::span<const std::uint8_t> bytes) {
  TreeReader r(bytes);
  if (r.u8() != kDown) return std::nullopt;
  DownMessage message;
  TreeVerdict& v = message.verdict;
  v.round = r.varint_as<std::uint32_t>();
  const std::uint8_t next = r.u8(), weighing = r.u8(), flags = r.u8();
  if (next > static_cast<std::uint8_t>(TreeVerdict::Next::kStop) ||
      weighing < static_cast<std::uint8_t>(TreeVerdict::Weighing::kWeigh) ||
      weighing > static_cast<std::uint8_t>(TreeVerdict::Weighing::kDecided) || flags > 31)
    return std::nullopt;
  v.next = static_cast<TreeVerdict::Next>(next);
  v.weighing = static_cast<TreeVerdict::Weighing>(weighing);
  v.accept = (flags & 1U) != 0;
  v.full = (flags & 2U) != 0;
  v.deferred = (flags & 4U) != 0;
  v.free = (flags & 8U) != 0;
  v.weigh_all = (flags & 16U) != 0;
  for (double* x : {&v.scale, &v.mu, &v.barc, &v.noise_scale, &v.usual_noise, &v.usual_pair.kappa,
                    &v.usual_pair.tau, &v.cost, &v.gradient})
    *x = r.number();
  const bool in_range = v.scale > 0.0 && v.scale <= 1.0 && v.mu >= 0.0 && v.barc >= 0.0 &&
                        v.noise_scale > 0.0 && v.usual_noise >= 1.0 && v.usual_pair.kappa > 0.0 &&
                        v.usual_pair.tau > 0.0 && v.gradient >= 0.0;
  if (!in_range) r.fail();
  for (double& x : v.drift) x = r.number();
  for (std::size_t n = r.count(kMaxElements, 29); n > 0; --n) {
    const auto robot = r.varint_as<RobotId>();
    v.moves.emplace_back(robot, r.single());
  }
  message.step = r.singles();
  message.inverse.diagonal.resize(r.count(kMaxElements, sizeof(float)));
  for (float& x : message.inverse.diagonal) x = r.small_number();
  message.inverse.correlations.resize(r.count(kMaxElements, sizeof(std::int16_t)));
  for (std::int16_t& x : message.inverse.correlations) x = static_cast<std::int16_t>(r.u16());
  return r.done() ? std::optional(std::move(message)) : std::nullopt;
}

bool is_up_message(std::span<const std::uint8_t> bytes) {
  return !bytes.empty() && bytes.front() == kUp;
}

}  // namespace km
