#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "runtime/dds/domain_draw.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

// Numbers that no other run of these tests draws at this time.
unsigned own_number() {
  return 1000 + static_cast<unsigned>(getpid()) * 16;
}

TEST_CASE("No domain is drawn twice, and a host without a free domain is reported") {
  const unsigned first = own_number();
  std::set<unsigned> drawn;
  for (unsigned i = 0; i < 5; ++i) drawn.insert(draw_domain(first, first + 4));
  CHECK(drawn.size() == 5);
  CHECK(*drawn.begin() == first);
  CHECK(*drawn.rbegin() == first + 4);
  CHECK_THROWS_WITH(draw_domain(first, first + 4), Contains("are taken") && Contains("--domain"));
}

TEST_CASE("A domain with a participant of a program that drew none is not drawn") {
  // Multicast, and unicast of the first and the fourth participant.
  const unsigned offset = GENERATE(0U, 10U, 16U);
  const int participant = socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  unsigned domain = 150;  // the first whose port is free
  do {
    address.sin_port = htons(static_cast<std::uint16_t>(7400 + 250 * ++domain + offset));
    REQUIRE(domain < 230);
  } while (bind(participant, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0);
  CHECK_THROWS_WITH(draw_domain(domain, domain), Contains("are taken"));
  close(participant);
}

TEST_CASE("A domain stays taken until the children of the process that drew it have ended") {
  const unsigned domain = own_number() + 8;
  const pid_t team = fork();
  if (team == 0) {
    setpgid(0, 0);  // the group outlives the team, and is killed below
    static_cast<void>(draw_domain(domain, domain));
    if (fork() == 0) pause();
    _exit(0);
  }
  int status = 0;
  REQUIRE(waitpid(team, &status, 0) == team);
  CHECK_THROWS(draw_domain(domain, domain));
  REQUIRE(kill(-team, SIGKILL) == 0);
  const auto drawn_again = [&] {
    try {
      return draw_domain(domain, domain) == domain;
    } catch (const std::runtime_error&) {
      return false;
    }
  };
  int attempts = 0;
  while (!drawn_again() && ++attempts < 10000) usleep(1000);
  CHECK(attempts < 10000);
}

}  // namespace
}  // namespace km
