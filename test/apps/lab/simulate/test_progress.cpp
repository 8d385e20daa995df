#include <catch2/catch.hpp>
#include <sstream>

#include "apps/lab/simulate/progress.hpp"

namespace km {

TEST_CASE("The time left follows from the frames rendered in this run", "[simulate]") {
  std::ostringstream output;
  Progress progress(output, false, 80);
  progress.start(100, 1100, 50.0);  // 100 are there from an earlier run
  CHECK(progress.text(100, 50.0) == "100 of 1100 frames, 9 %");
  CHECK(progress.text(300, 60.0) == "300 of 1100 frames, 27 %, 20.0 frames/s, 40 s left");
  CHECK(progress.text(1100, 100.0) == "1100 of 1100 frames, 100 %, 20.0 frames/s");
}

TEST_CASE("Off a terminal there is a line now and then, and the last one", "[simulate]") {
  std::ostringstream output;
  Progress progress(output, false, 80);
  progress.start(0, 100, 0.0);
  progress.update(10, 1.0);
  progress.update(50, Progress::kPlainInterval_s);
  progress.finish(100, 11.0);
  CHECK(output.str() ==
        "0 of 100 frames, 0 %\n50 of 100 frames, 50 %, 5.0 frames/s, 10 s left\n"
        "100 of 100 frames, 100 %, 9.1 frames/s\n");
}

TEST_CASE("On a terminal one line is redrawn and fits its width", "[simulate]") {
  std::ostringstream output;
  Progress progress(output, true, 40);
  progress.start(0, 100, 0.0);
  progress.update(50, 10.0);
  progress.finish(100, 20.0);
  const std::string text = output.str();
  CHECK_THAT(text, Catch::Contains("\r\x1b[K[############............] 50 of"));
  CHECK(std::count(text.begin(), text.end(), '\n') == 1);
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line, '\r');)
    CHECK(line.size() < 40 + std::string("\x1b[K\n").size());
}

TEST_CASE("Durations and sizes have units that people use", "[simulate]") {
  CHECK(duration_text(0.2) == "1 s");
  CHECK(duration_text(156.0) == "2 min 36 s");
  CHECK(duration_text(7265.0) == "2 h 1 min");
  CHECK(size_text(12.34e6) == "12.3 MB");
  CHECK(size_text(1.26e9) == "1.3 GB");
}

}  // namespace km
