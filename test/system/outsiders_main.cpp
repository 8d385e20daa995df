// Announces robots that do not exist, one after the other, until it is killed:
//   test_outsiders DOMAIN TEAM PER_SECOND
#include <chrono>
#include <iostream>
#include <memory>
#include <string>
#include <thread>

#include "runtime/dds/participant.hpp"

int main(int argc, char** argv) try {
  if (argc < 4) return 2;
  km::DdsConfig config;
  config.domain = std::stoi(argv[1]);
  config.team = argv[2];
  config.interface = "lo";
  const auto domain = std::make_shared<const km::DdsDomain>(config);
  const std::chrono::duration<double> period(1.0 / std::stod(argv[3]));
  for (std::uint32_t i = 0;; ++i) {
    const km::DdsParticipant outsider(
        domain, {static_cast<km::RobotId>(1000 + i), "outsider", km::kProtocolVersion, 1 + i});
    std::this_thread::sleep_for(period);
  }
} catch (const std::exception& error) {
  std::cerr << "test_outsiders: " << error.what() << '\n';
  return 1;
}
