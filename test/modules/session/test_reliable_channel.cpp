#include "modules/session/reliable_channel.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

SolverMessage solver_message(RobotId to, std::uint8_t content) {
  return {to, std::make_shared<const std::vector<std::uint8_t>>(1, content)};
}

TEST_CASE("a large message is repeated more rarely than a small one") {
  ReliableChannel channel({1, 1}, {}, 1.0);
  const SolverMessage large{3, std::make_shared<const std::vector<std::uint8_t>>(1'000'000)};
  (void)channel.write(solver_message(2, 10), 0.0);
  (void)channel.write(large, 0.0);
  std::map<RobotId, int> repeated;
  std::size_t bytes = 0;
  constexpr int kSeconds = 100;
  for (int s = 1; s <= kSeconds; ++s)
    for (const ReliableMessage& message : channel.due(s)) {
      ++repeated[message.to];
      bytes += message.bytes->size();
    }
  CHECK(repeated[2] >= kSeconds / 3);  // at least every three periods
  CHECK(repeated[3] >= 3);
  CHECK(bytes <= 60'000 * kSeconds);
  channel.reachable_again(3);
  const auto due = channel.due(kSeconds);
  CHECK(std::ranges::any_of(due, [](const ReliableMessage& message) { return message.to == 3; }));
}

TEST_CASE("messages are repeated until they are acknowledged") {
  ReliableChannel a({1, 1}, {}, 1.0), b({2, 1}, {}, 1.0);
  const auto arrives = [](ReliableChannel& at, const ReliableMessage& message, double now_s) {
    const bool is_new = at.read(message, now_s) == ReliableArrival::kNew;
    if (is_new) at.take(message);
    return is_new;
  };
  const ReliableMessage first = a.write(solver_message(2, 10), 0.0);
  const ReliableMessage second = a.write(solver_message(2, 11), 0.0);
  CHECK(a.due(0.9).empty());
  CHECK(a.due(1.0).size() == 2);
  CHECK(a.due(2.5).empty());  // increasing timeout
  CHECK(arrives(b, second, 1.0));
  CHECK_FALSE(arrives(b, second, 1.0));
  CHECK(arrives(b, first, 1.0));
  const auto acknowledgements = b.due(1.0);  // the second message arrived twice
  REQUIRE(acknowledgements.size() == 1);
  CHECK(acknowledgements[0].received == 2);
  CHECK_FALSE(arrives(a, acknowledgements[0], 1.0));
  CHECK(a.due(100.0).empty());
  const ReliableMessage answer = b.write(solver_message(1, 12), 2.0);
  CHECK(arrives(a, answer, 2.0));
  (void)a.write(solver_message(2, 13), 2.0);
  a.reachable_again(2);
  CHECK(a.due(2.0).size() == 1);
}

}  // namespace
}  // namespace km
