#include <catch2/catch.hpp>

#include "apps/robot/status.hpp"

namespace km {
namespace {

class BusyNode final : public Node {
 public:
  std::string_view name() const override { return "busy"; }
  void start() override {}
  void stop() noexcept override {}
  std::exception_ptr error() const override { return nullptr; }
  DurationHistogram timing() const override { return spent; }

  DurationHistogram spent;
};

TEST_CASE("Sensors that skip or corrupt frames are a warning, by kind", "[robot]") {
  CHECK(sensors_status(10, 0, {}).level == RosLevel::kOk);
  CHECK(sensors_status(10, 1, {}).level == RosLevel::kWarn);
  ReaderReport faults;
  faults.add(ReaderFault::kImuGap, "0.5 s after 7", 3);
  const RosDiagnosticStatus status = sensors_status(10, 1, faults);
  CHECK(status.level == RosLevel::kWarn);
  REQUIRE(status.values.size() == 3);
  CHECK(status.values[1].value == "1");
  CHECK(status.values[2].key == "gaps between inertial samples");
  CHECK(status.values[2].value == "3, first: 0.5 s after 7");
}

TEST_CASE("An uncertain place of a robot is a warning that names the robot", "[robot]") {
  OptimizerProgress progress{.anchor = 2, .members = {2, 4, 6}};
  CHECK(team_status(progress).level == RosLevel::kOk);
  progress.tentative = {4, 6};
  const RosDiagnosticStatus status = team_status(progress);
  CHECK(status.level == RosLevel::kWarn);
  CHECK(status.values.at(2).value == "4 6");
  progress.tentative.clear();
  progress.not_joined = {6};
  CHECK(team_status(progress).level == RosLevel::kWarn);
}

TEST_CASE("A module that hardly rests is a warning that names it", "[robot]") {
  BusyNode node;
  ModuleLoads loads({&node});
  CHECK(loads.status().level == RosLevel::kOk);
  node.spent.add(1e6);  // more than the possible time
  const RosDiagnosticStatus busy = loads.status();
  CHECK(busy.level == RosLevel::kWarn);
  CHECK(busy.message == "busy: busy");
  CHECK(busy.values.at(0).key == "busy busy [%]");
  CHECK(loads.status().level == RosLevel::kOk);  // since the last call
}

}  // namespace
}  // namespace km
