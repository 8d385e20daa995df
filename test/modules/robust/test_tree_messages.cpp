#include <sys/resource.h>

#include "modules/core/io/bytes.hpp"
#include "modules/robust/tree_messages.hpp"
#include "test/support/random_pose.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

using Eigen::Index;
using Bytes = std::vector<std::uint8_t>;

TreeSums some_sums() {
  TreeSums sums{.base_cost = 1.0 / 3.0,
                .cost = 17.25,
                .decrement = 1e-300,
                .largest = 4.5F,
                .largest_of_all = 5.5F,
                .open = 300,
                .changed = 7,
                .fractional = 1,
                .kept = 5,
                .rejected = 900,
                .left = 2,
                .fixed = 0,
                .dropped = 11,
                .doubted = 3,
                .poses = 4'000'000'000U,
                .lengths = {{0, 1}, {90, 1'000'000}, {65535, 3}}};
  sums.votes = {{.a = 1,
                 .b = 2,
                 .used = 12,
                 .motion = {.T = {.t = {1.0F, 2.0F, 3.0F}},
                            .centre = {4.0, 5.0, 1.0 / 3.0},
                            .rival = {.t = {-1.0F, 2.0F, 3.0F}},
                            .rival_centre = {-4.0, 0.0, 1e-3},
                            .radius_m = 6.0,
                            .spread_m = 0.7,
                            .consistent_m = 1.5,
                            .votes = 4.25,
                            .rival_votes = 3.5,
                            .strength = {.kappa = 8.5, .tau = 1e-3}},
                 .noise = 1.75F},
                {.a = 1, .b = 60000, .used = 0},
                {.a = 3, .b = 9, .used = 70000}};
  sums.pulls = {{.a = 1, .b = 2, .sum = {0.5, -3.0, 1.0 / 3.0}, .weight = 9.5, .closures = 3.0},
                {.a = 1, .b = 3}};
  return sums;
}

Eigen::VectorXd some_numbers(std::mt19937& rng, Index count) {
  std::normal_distribution<double> normal;
  Eigen::VectorXd values(count);
  for (double& x : values) x = normal(rng);
  return values;
}

// Four poses of three robots. Only edges in TreeSystem::edges end on the last pose and add to one
// of the couplings, so that their blocks are zero.
TreeSystem some_system(std::mt19937& rng, Index block) {
  TreeSystem system;
  system.variables = {{{2, 0}, 1, 1}, {{2, 300}, 1, 2}, {{7, 5}, 2, 0}, {{60000, 1}, 1, 0}};
  system.pairs = {{0, 1}, {0, 2}, {2, 3}};
  system.schur = BlockMatrix::zero(block, 4, 3);
  for (int v = 0; v < 3; ++v) {
    const Eigen::VectorXd x = some_numbers(rng, block);
    system.schur.at(v) = x * x.transpose();
  }
  for (int p = 0; p < 2; ++p) system.schur.between(p).reshaped() = some_numbers(rng, block * block);
  for (const Curvature curvature : {Curvature::kGaussNewton, Curvature::kFull})
    for (const bool transposed : {false, true}) {
      SentEdge edge{.pair = 2,
                    .transposed = transposed,
                    .curvature = curvature,
                    .kappa = 123.5F,
                    .tau = 1e-3F,
                    .weight = transposed ? 0.25F : 1.0F,
                    .present = SinglePose::of(random_pose(rng)),
                    .measured = {}};
      if (curvature == Curvature::kFull) edge.measured = SinglePose::of(random_pose(rng));
      system.edges.push_back(edge);
    }
  return system;
}

UpMessage some_up_message(Index block, bool with_system) {
  std::mt19937 rng(5);
  UpMessage message{.round = 70000, .sums = some_sums(), .failed = false};
  message.reduced = some_numbers(rng, 4 * block);
  if (with_system)
    message.system = some_system(rng, block);
  else
    message.weights = {{0, 1.0F}, {300, 0.0F}, {4'000'000'000U, 0.125F}};
  return message;
}

DownMessage some_down_message(TreeVerdict::Next next, TreeVerdict::Weighing weighing) {
  std::mt19937 rng(6);
  DownMessage message;
  message.verdict = {.round = 70000,
                     .next = next,
                     .accept = true,
                     .full = false,
                     .deferred = true,
                     .free = false,
                     .weigh_all = true,
                     .restart = next == TreeVerdict::Next::kRefresh,
                     .weighing = weighing,
                     .scale = 0.25,
                     .mu = 1e30,
                     .barc = 5.28,
                     .noise_scale = 1.0 / 3.0,
                     .doubt = next == TreeVerdict::Next::kStep ? 0.25 : 0.0,
                     .usual_noise = 2.5,
                     .moves = {{7, {.t = {1.0F, 2.0F, 3.0F}}}, {9, {}}},
                     .odometry = {{1, 2.5}, {4, 1.0}},
                     .usual_pair = {.kappa = 12.5, .tau = 1e-7},
                     .released = {{1, 2}, {1, 300}},
                     .cost = 1687.0,
                     .gradient = 1e-9,
                     .drift = {1.0, -2.0, 3.0, 0.0, 1e-200, 6.0}};
  message.step = some_numbers(rng, 12).cast<float>().cast<double>();
  message.inverse = {.diagonal = {1.5, 0.0, 0.25}, .correlations = {-32767.0, 0.0, 5.0, 32767.0}};
  if (next == TreeVerdict::Next::kStep)
    message.inverse = {.fine = true, .diagonal = {1e-3}, .correlations = {1.0 / 3.0, -1.0}};
  return message;
}

UpMessage up_again(const UpMessage& message) {
  auto received = decode_up(encode(message));
  REQUIRE(received);
  return std::move(*received);
}

// Every field of these messages has a value of its own. Equal bytes after decoding and encoding
// therefore mean that decoding restores every field.
TEST_CASE("Decoding restores a message up the tree") {
  UpMessage empty_system{.round = 1, .sums = {}};
  empty_system.system.emplace().schur = BlockMatrix::zero(6, 0, 0);
  for (const UpMessage& sent :
       {some_up_message(3, true), some_up_message(6, true), some_up_message(6, false), empty_system,
        UpMessage{.round = 3, .sums = {}, .failed = true}}) {
    const UpMessage received = up_again(sent);
    CHECK(encode(received) == encode(sent));
    CHECK(received.system.has_value() == sent.system.has_value());
    CHECK(is_up_message(encode(sent)));
    CHECK_FALSE(decode_down(encode(sent)));
  }
}

TEST_CASE("Couplings are rounded to 2^-32 of the geometric mean of their diagonal entries") {
  const TreeSystem sent = *some_up_message(GENERATE(3, 6), true).system;
  const TreeSystem received = *up_again({.sums = {}, .system = sent}).system;
  CHECK(received.schur.diagonal == sent.schur.diagonal);
  for (std::size_t p = 0; p < sent.pairs.size(); ++p) {
    const auto [i, j] = sent.pairs[p];
    const Eigen::MatrixXd a = received.schur.between(static_cast<int>(p));
    const Eigen::MatrixXd b = sent.schur.between(static_cast<int>(p));
    for (Index row = 0; row < a.rows(); ++row)
      for (Index c = 0; c < a.cols(); ++c)
        CHECK(std::abs(a(row, c) - b(row, c)) <=
              0x1p-33 * std::sqrt(sent.schur.at(i)(row, row) * sent.schur.at(j)(c, c)) *
                  (1.0 + 1e-9));
  }
}

TEST_CASE("A zero block costs one bit") {
  UpMessage dense = some_up_message(6, true), sparse = dense;
  sparse.system->schur = BlockMatrix::zero(6, 4, 3);
  sparse.system->schur.diagonal = dense.system->schur.diagonal;
  const std::size_t size = encode(dense).size();
  CHECK(size - encode(sparse).size() >= 2 * 36);
  CHECK(size - encode(sparse).size() <= 6 * 2 * 36);
  dense.system->schur.between(0).setConstant(1e-12);  // rounds to zero
  CHECK(size - encode(dense).size() >= 36);
  sparse.system->schur = BlockMatrix::zero(6, 4, 3);
  CHECK(size - encode(sparse).size() >= 8 * 3 * 21 + 2 * 36);
}

TEST_CASE("A coupling that no diagonal entry explains is bounded") {
  UpMessage sent = some_up_message(6, true);
  BlockMatrix& schur = sent.system->schur;
  schur.at(0)(1, 1) = 0.0;
  schur.between(0)(1, 2) = 1.0;
  schur.between(0)(2, 3) = -1e300;
  schur.between(0)(2, 4) = INFINITY;
  schur.between(0)(3, 3) = std::nan("");
  const UpMessage received = up_again(sent);
  CHECK(received.system->schur.between(0)(1, 2) == 0.0);
  CHECK(received.system->schur.between(0)(2, 3) > -1e10);
  CHECK(received.system->schur.between(0)(2, 4) < 1e10);
  CHECK(encode(received) == encode(sent));
}

TEST_CASE("Decoding restores a message down the tree") {
  using Next = TreeVerdict::Next;
  using Weighing = TreeVerdict::Weighing;
  const Next next = GENERATE(Next::kStep, Next::kShorten, Next::kRefresh, Next::kStart,
                             Next::kCount, Next::kDone, Next::kStop);
  const Weighing weighing = GENERATE(Weighing::kWeigh, Weighing::kHold, Weighing::kDecided);
  const DownMessage sent = some_down_message(next, weighing);
  const auto received = decode_down(encode(sent));
  REQUIRE(received);
  CHECK(received->verdict.next == next);
  CHECK(received->verdict.weighing == weighing);
  CHECK(encode(*received) == encode(sent));
  CHECK_FALSE(is_up_message(encode(sent)));
  CHECK_FALSE(decode_up(encode(sent)));
}

std::vector<Bytes> one_of_each() {
  return {encode(some_up_message(6, true)), encode(some_up_message(3, true)),
          encode(some_up_message(6, false)),
          encode(some_down_message(TreeVerdict::Next::kStep, TreeVerdict::Weighing::kWeigh))};
}

// Checks that decoding fails, or gives a message that encode() writes as equal bytes.
void check_harmless(const Bytes& bytes) {
  if (const auto up = decode_up(bytes); up && encode(*up) != bytes) FAIL_CHECK("another message");
  if (const auto down = decode_down(bytes); down && encode(*down) != bytes)
    FAIL_CHECK("another message");
}

TEST_CASE("A message truncated anywhere is refused") {
  for (const Bytes& bytes : one_of_each()) {
    for (std::size_t size = 0; size < bytes.size(); ++size) {
      const std::span<const std::uint8_t> cut(bytes.data(), size);
      if (!decode_up(cut) && !decode_down(cut)) continue;
      CAPTURE(size, bytes.size());
      FAIL_CHECK("was read");
    }
    Bytes longer = bytes;
    longer.push_back(0);
    CHECK_FALSE(decode_up(longer));
    CHECK_FALSE(decode_down(longer));
  }
}

std::size_t largest_resident_kb() {
  rusage usage{};
  REQUIRE(getrusage(RUSAGE_SELF, &usage) == 0);
  return static_cast<std::size_t>(usage.ru_maxrss);
}

TEST_CASE("A message with a wrong byte is refused, or is another valid message") {
  std::mt19937 rng(7);
  const std::vector<Bytes> messages = one_of_each();
  constexpr int kChanges = 100000;
  const std::size_t before_kb = largest_resident_kb();
  for (int n = 0; n < kChanges; ++n) {
    Bytes bytes = messages[static_cast<std::size_t>(n) % messages.size()];
    const std::size_t at = std::uniform_int_distribution<std::size_t>(0, bytes.size() - 1)(rng);
    bytes[at] = static_cast<std::uint8_t>(std::uniform_int_distribution<int>(0, 255)(rng));
    CAPTURE(n, at);
    check_harmless(bytes);
  }
  // The limit includes memory that a sanitizer retains.
  CHECK(largest_resident_kb() - before_kb < 512 * 1024);
}

// `count` in place of each byte, and so also in place of each count.
TEST_CASE("Counts beyond the size of the message are refused") {
  const std::uint64_t count = GENERATE(std::uint64_t{1} << 61U, ~std::uint64_t{0});
  CAPTURE(count);
  const std::size_t before_kb = largest_resident_kb();
  ByteWriter out;
  out.varint(count);
  const Bytes huge = out.release();
  for (const Bytes& bytes : one_of_each())
    for (std::size_t k = 0; k < bytes.size(); ++k) {
      Bytes changed = bytes;
      changed.erase(changed.begin() + static_cast<std::ptrdiff_t>(k));
      changed.insert(changed.begin() + static_cast<std::ptrdiff_t>(k), huge.begin(), huge.end());
      check_harmless(changed);
    }
  CHECK(largest_resident_kb() - before_kb < 64 * 1024);
}

TEST_CASE("Verdicts with numbers out of range are refused") {
  using V = TreeVerdict;
  const std::vector<void (*)(V&)> faults{[](V& v) { v.scale = 1.5; },
                                         [](V& v) { v.scale = 0.0; },
                                         [](V& v) { v.mu = -1.0; },
                                         [](V& v) { v.barc = -1.0; },
                                         [](V& v) { v.noise_scale = 0.0; },
                                         [](V& v) { v.usual_noise = 0.5; },
                                         [](V& v) { v.usual_pair.tau = -1.0; },
                                         [](V& v) { v.usual_pair.kappa = 0.0; },
                                         [](V& v) { v.gradient = -1.0; },
                                         [](V& v) { v.cost = INFINITY; }};
  for (std::size_t k = 0; k < faults.size(); ++k) {
    CAPTURE(k);
    DownMessage message = some_down_message(V::Next::kStep, V::Weighing::kWeigh);
    faults[k](message.verdict);
    CHECK_FALSE(decode_down(encode(message)));
  }
}

TEST_CASE("Inconsistent systems are refused") {
  using S = TreeSystem;
  const std::vector<void (*)(S&)> faults{[](S& s) { s.edges[0].pair = 3; },
                                         [](S& s) { s.edges[0].kappa = 0.0F; },
                                         [](S& s) { s.edges[0].tau = -1.0F; },
                                         [](S& s) { s.edges[0].weight = 1.5F; },
                                         [](S& s) { s.edges[0].present.q.coeffs() *= 2.0F; },
                                         [](S& s) { s.edges[0].present.t.x() = std::nanf(""); },
                                         [](S& s) { s.schur.at(0)(0, 0) = std::nan(""); },
                                         [](S& s) { s.schur = BlockMatrix::zero(4, 4, 3); }};
  for (std::size_t k = 0; k < faults.size(); ++k) {
    CAPTURE(k);
    UpMessage message = some_up_message(6, true);
    faults[k](*message.system);
    CHECK_FALSE(decode_up(encode(message)));
  }
  // The encoder needs pairs of existing variables, so these are changed in the bytes.
  const auto with_first_pair = [](std::uint8_t i, std::uint8_t j) {
    Bytes bytes = encode(some_up_message(6, true));
    const Bytes pairs{3, 0, 1, 0, 2, 2, 3};
    const auto found = std::search(bytes.begin(), bytes.end(), pairs.begin(), pairs.end());
    REQUIRE(found != bytes.end());
    found[1] = i;
    found[2] = j;
    return decode_up(bytes).has_value();
  };
  CHECK(with_first_pair(0, 1));
  CHECK_FALSE(with_first_pair(0, 4));
  CHECK_FALSE(with_first_pair(0, 0));
}

}  // namespace
}  // namespace km
