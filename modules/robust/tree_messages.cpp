#include "modules/robust/tree_messages.hpp"

#include <algorithm>
#include <functional>
#include <iterator>

#include "modules/core/data/byte_archive.hpp"
#include "modules/robust/odometry_evidence.hpp"

namespace km {
namespace {

using Eigen::Index;

// First bytes of messages.
constexpr std::uint8_t kUp = 1;
constexpr std::uint8_t kDown = 2;
constexpr std::size_t kMaxElements = 1U << 24U;

constexpr auto below = [](const auto& x, const auto& y) {
  return std::pair(x.a, x.b) < std::pair(y.a, y.b);
};

// Merges two ascending lists. An entry of a pair that has one is added to it.
template <typename T, typename Add>
void merge_pairs(std::vector<T>& into, const std::vector<T>& other, const Add& add) {
  std::vector<T> all;
  std::merge(into.begin(), into.end(), other.begin(), other.end(), std::back_inserter(all), below);
  into.clear();
  for (const T& entry : all) {
    if (into.empty() || below(into.back(), entry))
      into.push_back(entry);
    else
      add(into.back(), entry);
  }
}

// A whole number of units of a coupling; small numbers of either sign take one byte.
void describe_coupling(auto& archive, auto&& coupling, double unit) {
  const std::int64_t units = in_units(coupling, unit);
  auto code = (static_cast<std::uint64_t>(units) << 1U) ^ static_cast<std::uint64_t>(units >> 63U);
  archive(code);
  if constexpr (kReads<decltype(archive)>) {
    const auto read = static_cast<std::int64_t>((code >> 1U) ^ (~(code & 1U) + 1U));
    coupling = static_cast<double>(read) * unit;
    archive.require(in_units(coupling, unit) == read);
  }
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

}  // namespace

void TreeSums::add(const TreeSums& other) {
  base_cost += other.base_cost;
  cost += other.cost;
  decrement += other.decrement;
  largest = std::max(largest, other.largest);
  largest_of_all = std::max(largest_of_all, other.largest_of_all);
  open += other.open;
  changed += other.changed;
  fractional += other.fractional;
  kept += other.kept;
  rejected += other.rejected;
  left += other.left;
  fixed += other.fixed;
  dropped += other.dropped;
  doubted += other.doubted;
  poses += other.poses;
  for (const auto& [bin, n] : other.lengths) lengths[bin] += n;
  merge_pairs(votes, other.votes, [](PairVote& x, const PairVote& y) { x.used += y.used; });
  merge_pairs(pulls, other.pulls, [](PairPull& x, const PairPull& y) {
    x.sum += y.sum;
    x.weight += y.weight;
    x.closures += y.closures;
  });
}

// Archives find these functions by argument-dependent lookup, which sees no unnamed namespace.

void describe(auto& archive, As<PairMotion> auto& m) {
  archive(m.T, m.centre, m.rival, m.rival_centre);
  for (auto* x : {&m.radius_m, &m.spread_m, &m.consistent_m, &m.votes, &m.rival_votes,
                  &m.strength.kappa, &m.strength.tau}) {
    archive(*x);
    archive.require(*x >= 0.0);
  }
}

void describe(auto& archive, As<PairVote> auto& v) {
  archive(v.a, v.b, v.used, v.motion, v.noise);
  archive.list(v.odometry, kMaxElements, sizeof(float));
  archive.require(v.odometry.empty() || v.odometry.size() == kNoiseLevels * kNoiseLevels);
  archive.require(v.noise >= 0.0F);
}

void describe(auto& archive, As<TreeSums> auto& s) {
  archive(s.base_cost, s.cost, s.decrement, s.largest, s.largest_of_all, s.open, s.changed,
          s.fractional, s.kept, s.rejected, s.left, s.fixed, s.dropped, s.doubted, s.poses);
  using Length = std::pair<std::uint16_t, std::uint32_t>;
  std::vector<Length> lengths(s.lengths.begin(), s.lengths.end());
  archive.list(lengths, kMaxElements, 2,
               [&](auto& length) { archive(length.first, length.second); });
  archive.require(std::ranges::adjacent_find(lengths, std::ranges::greater_equal(),
                                             &Length::first) == lengths.end());
  if constexpr (kReads<decltype(archive)>) s.lengths = {lengths.begin(), lengths.end()};
  archive.list(s.votes, kMaxElements, 168);
  archive.require(std::ranges::adjacent_find(s.votes, std::not_fn(below)) == s.votes.end());
  archive.list(s.pulls, kMaxElements, 42,
               [&](auto& pull) { archive(pull.a, pull.b, pull.sum, pull.weight, pull.closures); });
  archive.require(std::ranges::adjacent_find(s.pulls, std::not_fn(below)) == s.pulls.end());
}

void describe(auto& archive, As<TreeVariable> auto& v) {
  archive(v.id, v.touched, v.of);
}

void describe(auto& archive, As<SentEdge> auto& e) {
  bool full = e.curvature == Curvature::kFull;
  std::uint32_t code = 4U * static_cast<std::uint32_t>(e.pair) + (e.transposed ? 2U : 0U) + full;
  archive(code, e.kappa, e.tau, e.weight, e.present);
  archive.require(e.kappa > 0.0F && e.tau > 0.0F && e.weight >= 0.0F && e.weight <= 1.0F);
  if constexpr (kReads<decltype(archive)>) {
    e.pair = static_cast<int>(code / 4U);
    e.transposed = (code & 2U) != 0;
    full = (code & 1U) != 0;
    e.curvature = full ? Curvature::kFull : Curvature::kGaussNewton;
  }
  if (full) archive(e.measured);
}

// One bit for each block that is present, then these blocks.
void describe_blocks(auto& archive, As<TreeSystem> auto& system, Index B) {
  const std::size_t n = system.variables.size(), blocks = n + system.pairs.size();
  std::vector<std::uint8_t> bits((blocks + 7) / 8);
  const auto take_present = [&](const std::vector<bool>& present) {
    std::ranges::fill(bits, std::uint8_t{0});
    for (std::size_t k = 0; k < blocks; ++k)
      if (present[k]) bits[k / 8] |= static_cast<std::uint8_t>(1U << (k % 8));
  };
  if constexpr (!kReads<decltype(archive)>) take_present(present_blocks(system));
  for (std::uint8_t& byte : bits) archive(byte);
  const auto present = [&](std::size_t k) { return ((bits[k / 8] >> (k % 8)) & 1U) != 0; };
  if constexpr (kReads<decltype(archive)>) {
    std::size_t least = 0;
    for (std::size_t k = 0; k < blocks; ++k)
      if (present(k)) least += static_cast<std::size_t>(k < n ? 4 * B * (B + 1) : B * B);
    archive.require(least <= archive.left());
    if (archive.failed()) return;
    system.schur = BlockMatrix::zero(B, n, system.pairs.size());
  }
  for (std::size_t k = 0; k < n; ++k) {
    auto block = system.schur.at(static_cast<int>(k));
    for (Index c = 0; present(k) && c < B; ++c)
      for (Index row = c; row < B; ++row) {
        archive(block(row, c));
        if constexpr (kReads<decltype(archive)>) block(c, row) = block(row, c);
      }
  }
  for (std::size_t p = 0; p < system.pairs.size(); ++p) {
    auto values = system.schur.between(static_cast<int>(p));
    for (Index c = 0; present(n + p) && c < B; ++c)
      for (Index row = 0; row < B; ++row)
        describe_coupling(archive, values(row, c),
                          unit_of_coupling(system.schur, system.pairs[p], row, c));
  }
  if constexpr (kReads<decltype(archive)>) {  // equal systems have equal bytes
    const std::vector<std::uint8_t> received = bits;
    take_present(present_blocks(system));
    archive.require(received == bits);
  }
}

void describe(auto& archive, As<TreeSystem> auto& system) {
  auto block = static_cast<std::uint8_t>(system.schur.block());
  archive(block);
  archive.require(block == 3 || block == 6);
  archive.list(system.variables, kMaxElements, 4);
  archive.list(system.pairs, kMaxElements, 2, [&](auto& pair) {
    auto i = static_cast<std::uint32_t>(pair[0]), j = static_cast<std::uint32_t>(pair[1]);
    archive(i, j);
    archive.require(i != j && std::max(i, j) < system.variables.size());
    if constexpr (kReads<decltype(archive)>) pair = {static_cast<int>(i), static_cast<int>(j)};
  });
  if constexpr (kReads<decltype(archive)>)
    if (archive.failed()) return;
  describe_blocks(archive, system, block);
  archive.list(system.edges, kMaxElements, 41);
  for (const SentEdge& e : system.edges)
    archive.require(static_cast<std::size_t>(e.pair) < system.pairs.size());
}

// In double or in single precision.
template <typename Number>
void describe_rows(auto& archive, auto& values) {
  auto rows = static_cast<std::size_t>(values.size());
  archive.count(rows, kMaxElements, sizeof(Number));
  if constexpr (kReads<decltype(archive)>)
    values.resize(static_cast<decltype(values.size())>(rows));
  for (auto& value : values) {
    auto number = static_cast<Number>(value);
    archive(number);
    if constexpr (kReads<decltype(archive)>) value = static_cast<double>(number);
  }
}

void describe(auto& archive, As<UpMessage> auto& m) {
  archive(m.round, m.failed, m.sums);
  describe_rows<double>(archive, m.reduced);
  archive.optional(m.system, [&](auto& system) { archive(system); });
  archive.list(m.weights, kMaxElements, 5, [&](auto& changed) {
    archive(changed.edge, changed.weight);
    archive.require(changed.weight >= 0.0F && changed.weight <= 1.0F);
  });
}

void describe(auto& archive, As<TreeVerdict> auto& v) {
  archive(v.round);
  archive.choice(v.next, TreeVerdict::Next::kStop);
  archive.choice(v.weighing, TreeVerdict::Weighing::kDecided);
  archive.flags(v.accept, v.full, v.deferred, v.free, v.weigh_all, v.restart);
  archive(v.scale, v.mu, v.barc, v.noise_scale, v.doubt, v.usual_noise, v.usual_pair.kappa,
          v.usual_pair.tau, v.cost, v.gradient);
  archive.require(v.scale > 0.0 && v.scale <= 1.0 && v.mu >= 0.0 && v.barc >= 0.0 &&
                  v.noise_scale > 0.0 && v.doubt >= 0.0 && v.usual_noise >= 1.0 &&
                  v.usual_pair.kappa > 0.0 && v.usual_pair.tau > 0.0 && v.gradient >= 0.0);
  for (auto& x : v.drift) archive(x);
  archive.list(v.moves, kMaxElements, 29, [&](auto& move) { archive(move.first, move.second); });
  archive.list(v.odometry, kMaxElements, 9, [&](auto& noise) {
    archive(noise.first, noise.second);
    archive.require(noise.second >= 1.0);
  });
  archive.list(v.released, kMaxElements, 2, [&](auto& pair) { archive(pair.first, pair.second); });
}

void describe(auto& archive, As<DownMessage> auto& m) {
  archive(m.verdict);
  describe_rows<float>(archive, m.step);
  const bool fine = m.verdict.doubt > 0.0;
  if constexpr (kReads<decltype(archive)>) m.inverse.fine = fine;
  if (fine) {
    describe_rows<double>(archive, m.inverse.diagonal);
    return describe_rows<double>(archive, m.inverse.correlations);
  }
  describe_rows<float>(archive, m.inverse.diagonal);
  archive.list(m.inverse.correlations, kMaxElements, sizeof(std::int16_t), [&](auto& correlation) {
    auto bits = static_cast<std::uint16_t>(static_cast<std::int16_t>(correlation));
    archive.fixed(bits);
    if constexpr (kReads<decltype(archive)>) correlation = static_cast<std::int16_t>(bits);
  });
}

namespace {

std::vector<std::uint8_t> encoded(std::uint8_t kind, const auto& message) {
  ArchiveWriter archive;
  archive(kind, message);
  return archive.release();
}

template <typename Message>
std::optional<Message> decoded(std::uint8_t kind, std::span<const std::uint8_t> bytes) {
  ArchiveReader archive(bytes);
  std::uint8_t first = 0;
  archive(first);
  if (first != kind) return std::nullopt;
  Message message{};
  archive(message);
  return archive.done() ? std::optional(std::move(message)) : std::nullopt;
}

}  // namespace

std::vector<std::uint8_t> encode(const UpMessage& message) {
  return encoded(kUp, message);
}

std::vector<std::uint8_t> encode(const DownMessage& message) {
  return encoded(kDown, message);
}

std::optional<UpMessage> decode_up(std::span<const std::uint8_t> bytes) {
  return decoded<UpMessage>(kUp, bytes);
}

std::optional<DownMessage> decode_down(std::span<const std::uint8_t> bytes) {
  return decoded<DownMessage>(kDown, bytes);
}

bool is_up_message(std::span<const std::uint8_t> bytes) {
  return !bytes.empty() && bytes.front() == kUp;
}

}  // namespace km
