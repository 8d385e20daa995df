#include <exception>
#include <fstream>
#include <iostream>
#include <opencv2/core.hpp>

#include "apps/robot/run.hpp"
#include "runtime/log.hpp"

namespace {

constexpr int kBadInput = 1;

km::log::Level level_of(const std::string& name) {
  if (name == "error") return km::log::Level::kError;
  if (name == "warn") return km::log::Level::kWarn;
  return name == "debug" ? km::log::Level::kDebug : km::log::Level::kInfo;
}

}  // namespace

int main(int argc, char** argv) try {
  const km::RobotOptions options = km::parse_options(argc, argv);
  km::SignalWatch signals;  // before any thread: they inherit the blocked signals
  km::log::set_level(level_of(options.log_level));
  cv::setNumThreads(1);  // every module has its own thread; OpenCV's pool would fight them
  return km::run_robot(options, signals);
} catch (const std::exception& error) {
  std::cerr << "kimera_multi_robot: " << error.what() << '\n';
  return kBadInput;
}
