#include "runtime/dds/robot_identity.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

TEST_CASE("An identity survives its user data") {
  const RobotIdentity identity{65535, "Alpha 1", 7, 0x0123456789ABCDEFULL};
  const std::string data = to_user_data(identity);
  CHECK(data == "robot=65535;name=Alpha 1;proto=7;boot=0123456789abcdef");
  const auto parsed = parse_user_data(data);
  REQUIRE(parsed.value.has_value());
  CHECK(parsed.value->identity == identity);
  CHECK(parsed.value->credentials.empty());
  const auto with_keys = parse_user_data(to_user_data(identity, "AbC-_9"));
  REQUIRE(with_keys.value.has_value());
  CHECK(with_keys.value->identity == identity);
  CHECK(with_keys.value->credentials == "AbC-_9");
}

TEST_CASE("Keys of a later protocol are ignored") {
  CHECK(parse_user_data("robot=1;name=a;proto=1;boot=1;colour=red;=;;").value.has_value());
}

TEST_CASE("User data that is not an identity is refused with the reason") {
  const auto refusal = [](const std::string& data) {
    const auto parsed = parse_user_data(data);
    return std::string(parsed.value ? "accepted" : parsed.refusal);
  };
  CHECK(refusal("") == "user data lacks a field");
  CHECK(refusal("robot=1;name=a;proto=1") == "user data lacks a field");
  CHECK(refusal("robot=1;robot=2;name=a;proto=1;boot=1") == "user data names a field twice");
  CHECK(refusal("robot=65536;name=a;proto=1;boot=1") == "robot id is not a 16-bit number");
  CHECK(refusal("robot=-1;name=a;proto=1;boot=1") == "robot id is not a 16-bit number");
  CHECK(refusal("robot=1 ;name=a;proto=1;boot=1") == "robot id is not a 16-bit number");
  CHECK(refusal("robot=1;name=;proto=1;boot=1") == "robot name is not printable");
  CHECK(refusal("robot=1;name=a\033[2J;proto=1;boot=1") == "robot name is not printable");
  CHECK(refusal("robot=1;name=" + std::string(65, 'a') + ";proto=1;boot=1") ==
        "robot name is not printable");
  CHECK(refusal("robot=1;name=a;proto=x;boot=1") == "protocol version is not a 16-bit number");
  CHECK(refusal("robot=1;name=a;proto=1;boot=0") == "boot id is not a nonzero 64-bit number");
  CHECK(refusal("robot=1;name=a;proto=1;boot=10123456789abcdef") ==
        "boot id is not a nonzero 64-bit number");
  CHECK(refusal("robot=1;name=a;proto=1;boot=1;x=" + std::string(2000, 'x')) ==
        "user data too long");
}

TEST_CASE("A name that cannot be sent is refused at home") {
  CHECK_THROWS_AS(to_user_data({1, "", 1, 1}), std::invalid_argument);
  CHECK_THROWS_AS(to_user_data({1, "a;b", 1, 1}), std::invalid_argument);
  CHECK_THROWS_AS(to_user_data({1, "tab\t", 1, 1}), std::invalid_argument);
}

TEST_CASE("An incarnation can be resumed as often as its counter permits") {
  const std::uint64_t first = random_boot_id();
  std::uint64_t boot = first;
  constexpr std::uint32_t kMost = 65535;
  for (std::uint32_t count = 1; count <= kMost; ++count) {
    boot = next_boot(boot);
    REQUIRE(resume_count(boot) == count);
  }
  CHECK(boot != first);
  CHECK(is_same_incarnation(boot, first));
  CHECK_FALSE(is_same_incarnation(boot + 1, first));
  CHECK_THROWS_AS(next_boot(boot), std::overflow_error);
}

}  // namespace
}  // namespace km
