// A robot that only talks, as a process of its own: test_dds_peer ROBOT KEYS [SETTING...], where
// KEYS is its folder of keys or empty. Lines on standard input drive it:
//   ping FIRST LAST    events with these indices, to all
//   large INDEX        an event of 60 kB, to all
//   one ROBOT INDEX    to one robot
//   unmet              prints a robot that is announced and not met, as "unmet NAME: REASON"
//   quit
// It prints what happens: "joined 7", "lost 7", ..., "ping 7 INDEX", "one 7 INDEX", and at the end
// "summary RECEIVED DUPLICATES".
#include <iostream>
#include <mutex>
#include <sstream>
#include <string>

#include "modules/security/key_folder.hpp"
#include "runtime/clock.hpp"
#include "runtime/config_layers.hpp"
#include "runtime/log.hpp"
#include "test/runtime/dds/dds_fixture.hpp"

namespace km {
namespace {

std::mutex output_mutex;

void print_line(const std::string& line) {
  const std::lock_guard lock(output_mutex);
  std::cout << line << std::endl;
}

constexpr const char* kEventNames[] = {"joined", "reported",  "lost",    "returned", "resumed",
                                       "left",   "restarted", "refused", "conflict"};
static_assert(std::size(kEventNames) == static_cast<std::size_t>(PeerEventKind::kConflict) + 1);

void report(TestRobot& robot) {
  robot.bridge.peers().events().subscribe([](const auto& event) {
    print_line(std::string(kEventNames[static_cast<std::size_t>(event->kind)]) + ' ' +
               std::to_string(event->identity.robot));
  });
  const auto print = [](const char* what) {
    return [what](const std::shared_ptr<const Ping>& ping) {
      print_line(std::string(what) + ' ' + std::to_string(ping->robot) + ' ' +
                 std::to_string(ping->index));
    };
  };
  robot.pings.from_peers().subscribe(print("ping"));
  robot.addressed_pings.from_peers().subscribe(print("one"));
}

void obey(TestRobot& robot) {
  for (std::string line; std::getline(std::cin, line);) {
    std::istringstream words(line);
    std::string command;
    std::uint32_t a = 0, b = 0;
    words >> command >> a >> b;
    if (command == "quit") return;
    if (command == "unmet") {
      const auto unmet = [&robot] { return robot.bridge.peers().ask(&PeerTable::unmet); };
      if (eventually([&] { return !unmet().empty(); }))
        print_line("unmet " + unmet().begin()->first + ": " + unmet().begin()->second);
    }
    if (command == "one") robot.ping_one(static_cast<RobotId>(a), b);
    if (command == "large") robot.ping(a, std::vector<std::uint8_t>(60000));
    if (command == "ping")
      for (std::uint32_t i = a; i <= b; ++i) robot.ping(i, std::vector<std::uint8_t>(300));
  }
}

int run(int argc, char** argv) {
  log::set_level(log::Level::kWarn);
  ConfigLayers layers;
  for (int i = 3; i < argc; ++i) layers.add_override(argv[i]);
  const auto config = layers.load<DdsConfig>();
  layers.finish();

  const auto id = static_cast<RobotId>(std::stoi(argv[1]));
  const std::string keys = argv[2];
  const TestRobot::MakeSeal seal_of = [&keys](const RobotIdentity& own) {
    return std::make_shared<SharedSeal>(load_robot_keys(keys), own,
                                        static_cast<std::int64_t>(wall_now_s()));
  };
  TestRobot robot(config, new_process(id), keys.empty() ? TestRobot::MakeSeal() : seal_of);
  report(robot);
  robot.start();
  obey(robot);
  robot.stop();
  const TopicTraffic traffic = robot.traffic(Direction::kIn);
  print_line("summary " + std::to_string(traffic.count.messages) + ' ' +
             std::to_string(traffic.duplicates));
  return 0;
}

}  // namespace
}  // namespace km

int main(int argc, char** argv) try {
  return argc < 3 ? 2 : km::run(argc, argv);
} catch (const std::exception& error) {
  std::cerr << "test_dds_peer: " << error.what() << std::endl;
  return 1;
}
