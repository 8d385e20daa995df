#include <catch2/catch.hpp>
#include <sstream>
#include <string>

#include "apps/lab/experiments/run_steps.hpp"
#include "apps/lab/experiments/step_record.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

using Catch::Contains;

// Runs steps in a folder of their own.
struct Workshop {
  TemporaryFolder folder;
  SignalWatch signals;
  std::ostringstream shown;

  std::string path(const std::string& name) const { return (folder.path() / name).string(); }

  // Appends a line to NAME.out each time it is run.
  Step step(const std::string& name, const std::string& more = "true") const {
    return {.name = name,
            .title = name,
            .command = {"/bin/sh", "-c", "echo ran >> " + path(name + ".out") + "; " + more},
            .outputs = {path(name + ".out")}};
  }

  StepsOutcome run(const std::vector<Step>& steps, bool again = false) {
    StepDisplay display(shown, false, 80);
    return run_steps(steps, folder.path() / "results", again, signals, display);
  }

  long runs(const std::string& name) const {
    const std::string text = folder.read(name + ".out");
    return std::count(text.begin(), text.end(), '\n');
  }
};

TEST_CASE("A step is run once, and again if asked for", "[experiments]") {
  Workshop workshop;
  const std::vector<Step> steps{workshop.step("a"), workshop.step("b")};
  const StepsOutcome first = workshop.run(steps);
  CHECK(first.made == 2);
  CHECK(first.problems.empty());
  const StepsOutcome second = workshop.run(steps);
  CHECK(second.made == 0);
  CHECK(second.kept == 2);
  CHECK(workshop.runs("a") == 1);
  CHECK(workshop.run(steps, true).made == 2);
  CHECK(workshop.runs("b") == 2);
  CHECK_THAT(workshop.shown.str(), Contains("[2/2] b: done in"));
}

TEST_CASE("A step is run again if its command or the content of an input changes",
          "[experiments]") {
  Workshop workshop;
  Step step = workshop.step("a");
  step.inputs = {workshop.folder.write("input.txt", "1")};
  REQUIRE(workshop.run({step}).made == 1);
  workshop.folder.write("input.txt", "1");  // newer, with the same content
  CHECK(workshop.run({step}).made == 0);
  workshop.folder.write("input.txt", "2");
  CHECK(state_of(step, workshop.folder.path() / "results") == StepState::kOutdated);
  CHECK(workshop.run({step}).made == 1);
  step.command.back() += " # another";
  CHECK(workshop.run({step}).made == 1);
  step.writes = {{workshop.path("file.yaml"), "text\n"}};
  CHECK(workshop.run({step}).made == 1);
  CHECK(workshop.folder.read("file.yaml") == "text\n");
  std::filesystem::remove(workshop.path("a.out"));
  CHECK(workshop.run({step}).made == 1);
}

TEST_CASE("A failed step gives the reason, and prevents only the steps that need it",
          "[experiments]") {
  Workshop workshop;
  Step needs = workshop.step("needs");
  needs.needs = {"bad"};
  Step needs_more = workshop.step("needs_more");
  needs_more.needs = {"needs"};
  const std::vector<Step> steps{workshop.step("bad", "echo out of tape >&2; exit 7"), needs,
                                needs_more, workshop.step("free")};
  const StepsOutcome outcome = workshop.run(steps);
  CHECK(outcome.made == 1);
  REQUIRE(outcome.problems.size() == 2);
  CHECK_THAT(outcome.problems[0], Contains("bad: exit code 7") && Contains("out of tape") &&
                                      Contains("results/logs/bad.log"));
  CHECK(outcome.problems[1] == "not run, as bad is not done: needs, needs_more");
  CHECK(workshop.runs("free") == 1);
  CHECK(workshop.run(steps).problems.size() == 2);  // the failed step did not count as done
  CHECK(workshop.runs("bad") == 2);
}

TEST_CASE("Steps that fail for the same reason share a message", "[experiments]") {
  Workshop workshop;
  const char* const torn = "echo graph is torn >&2; exit 7";
  const StepsOutcome outcome = workshop.run(
      {workshop.step("a", torn), workshop.step("b", torn), workshop.step("c", "exit 2")});
  REQUIRE(outcome.problems.size() == 2);
  CHECK_THAT(outcome.problems[0], Catch::StartsWith("a, b: exit code 7\n    graph is torn"));
  CHECK_THAT(outcome.problems[1], Catch::StartsWith("c: exit code 2"));
}

TEST_CASE("The report of a failed step contains the standard output of its program",
          "[experiments]") {
  Workshop workshop;
  const StepsOutcome outcome = workshop.run({workshop.step("bad", "echo robot1 failed; exit 3")});
  REQUIRE(outcome.problems.size() == 1);
  CHECK_THAT(outcome.problems[0], Contains("bad: exit code 3\n    robot1 failed"));
}

TEST_CASE("A program that is missing, or makes no output, is a failure", "[experiments]") {
  Workshop workshop;
  Step missing = workshop.step("missing");
  missing.command = {workshop.path("no_program")};
  Step idle = workshop.step("idle");
  idle.command = {"/bin/true"};
  Step lacking = workshop.step("lacking");
  lacking.missing = "no recordings";
  const StepsOutcome outcome = workshop.run({missing, idle, lacking});
  REQUIRE(outcome.problems.size() == 3);
  CHECK_THAT(outcome.problems[0], Contains("no such program") && Contains("no_program"));
  CHECK_THAT(outcome.problems[1], Contains("it made no") && Contains("idle.out"));
  CHECK_THAT(outcome.problems[2], Contains("no recordings"));
}

TEST_CASE("Results made elsewhere are taken as they are, those of a broken run are not",
          "[experiments]") {
  Workshop workshop;
  Step step = workshop.step("recordings");
  step.adoptable = true;
  workshop.folder.write("recordings.out", "made elsewhere\n");
  const StepsOutcome outcome = workshop.run({step});
  CHECK(outcome.kept == 1);
  CHECK(workshop.folder.read("recordings.out") == "made elsewhere\n");
  const auto record = read_record(workshop.folder.path() / "results", "recordings");
  REQUIRE(record);
  CHECK(record->command.empty());
  step.command.back() += " # another";
  CHECK(workshop.run({step}).kept == 1);

  Step broken = workshop.step("broken", "exit 1");
  broken.adoptable = true;
  CHECK(workshop.run({broken}).problems.size() == 1);
  CHECK(state_of(broken, workshop.folder.path() / "results") != StepState::kFound);
}

TEST_CASE("A signal ends the running step and begins no other", "[experiments]") {
  Workshop workshop;
  const std::vector<Step> steps{workshop.step("done"),
                                workshop.step("long", "kill -INT $PPID; exec sleep 600"),
                                workshop.step("later")};
  const StepsOutcome outcome = workshop.run(steps);
  CHECK(outcome.stopped);
  CHECK(outcome.made == 1);
  CHECK(workshop.runs("done") == 1);
  CHECK(workshop.runs("later") == 0);
  const auto results = workshop.folder.path() / "results";
  CHECK(state_of(steps[0], results) == StepState::kDone);
  CHECK(state_of(steps[1], results) ==
        StepState::kOutdated);  // its output exists, but is incomplete
}

TEST_CASE("Results that a stopped or failed step did not change keep their record",
          "[experiments]") {
  Workshop workshop;
  const auto results = workshop.folder.path() / "results";
  const char* const fate = GENERATE("kill -INT $PPID; exec sleep 600", "exit 7");
  const bool touches = GENERATE(false, true);
  CAPTURE(fate, touches);
  const std::string input = workshop.folder.write("input.txt", "exit 0").string();
  Step step = workshop.step("a");
  const std::string beside = touches ? "touch " + workshop.path("beside.txt") + "; " : "";
  step.command.back() = "if test -e " + step.outputs[0].string() + "; then " + beside + ". " +
                        input + "; fi; " + step.command.back();
  step.inputs = {input};
  REQUIRE(workshop.run({step}).made == 1);
  workshop.folder.write("input.txt", fate);
  CHECK(workshop.run({step}).made == 0);
  CHECK(state_of(step, results) == StepState::kOutdated);
  workshop.folder.write("input.txt", "exit 0");
  CHECK(state_of(step, results) == (touches ? StepState::kOutdated : StepState::kDone));
}

TEST_CASE("It does not matter in which folder lies what a step writes about", "[experiments]") {
  Step step{.name = "a", .title = "a", .command = {"/bin/true"}};
  const auto fingerprint_with = [&](const std::string& text) {
    step.writes = {{"team.yaml", text}};
    return fingerprint_of(step);
  };
  const std::string here =
      fingerprint_with("config: /here/euroc.yaml\ndataset: \"/recorded/V1_01\"\n");
  CHECK(here ==
        fingerprint_with("config: /else/where/euroc.yaml\ndataset: \"/moved/there/V1_01\"\n"));
  CHECK(here != fingerprint_with("config: /here/euroc.yaml\ndataset: \"/recorded/V1_02\"\n"));
  CHECK(here != fingerprint_with("config: /here/euroc.yaml\ntruth: \"/recorded/V1_01\"\n"));
}

TEST_CASE("A record keeps how a result was made", "[experiments]") {
  Workshop workshop;
  const Step step = workshop.step("a", "echo '\"quoted\"'");
  REQUIRE(workshop.run({step}).made == 1);
  const auto record = read_record(workshop.folder.path() / "results", "a");
  REQUIRE(record);
  CHECK(record->command == step.command);
  CHECK(record->fingerprint == fingerprint_of(step));
  CHECK(record->machine.cores > 0);
  CHECK_FALSE(record->machine.processor.empty());
  CHECK_FALSE(record->commit.empty());
  CHECK_THAT(record->started, Contains("UTC"));
}

TEST_CASE("The display shows which step runs and how long all will take", "[experiments]") {
  std::ostringstream out;
  StepDisplay display(out, false, 80);
  display.expect(
      {{"closures", "pgo", 20.0}, {"team, City", "team", 100.0}, {"picture", "", 600.0}});
  display.start(1, 0.0);
  CHECK(display.text("robot0: 12 %", 40.0) ==
        "[2/3] team, City: 40 s, about 11 min left | robot0: 12 %");
  CHECK(display.text("", 130.0) ==
        "[2/3] team, City: 2 min 10 s, longer than expected, then about 10 min");
  display.update("early", 1.0);
  display.update("too soon", 5.0);
  display.update("shown", StepDisplay::kPlainInterval_s);
  display.finish("done", 124.0);
  CHECK_THAT(out.str(), !Contains("early") && !Contains("too soon") && Contains("shown") &&
                            Contains("[2/3] team, City: done in 2 min 4 s"));
  display.expect({{"closures", "pgo", 20.0}});
  display.start(0, 0.0);  // no step follows: no time is shown once it takes longer than expected
  CHECK(display.text("", 19.0) == "[1/1] closures: 19 s, less than a minute left");
  CHECK(display.text("", 300.0) == "[1/1] closures: 5 min 0 s, longer than expected");
}

TEST_CASE("Steps are expected to take as much longer as their program has so far",
          "[experiments]") {
  std::ostringstream out;
  StepDisplay display(out, false, 80);
  display.expect({{"a", "pcm", 60.0}, {"b", "pcm", 60.0}, {"c", "pcm", 0.0}, {"d", "pgo", 120.0}});
  const auto left_at_start = [&](std::size_t index) {
    display.start(index, 0.0);
    return display.text("", 0.0).substr(display.text("", 0.0).find(", ") + 2);
  };
  CHECK(left_at_start(0) == "about 4 min left");
  display.finish("done", 180.0);  // three times as long as thought
  CHECK(left_at_start(1) == "about 5 min left");
  display.finish("FAILED", 1.0);
  CHECK(left_at_start(2) == "about 2 min left");
  display.expect({{"e", "none", 9000.0}});
  CHECK(left_at_start(0) == "about 2.5 h left");
}

TEST_CASE("A terminal's line is redrawn and never wider than it", "[experiments]") {
  std::ostringstream out;
  StepDisplay display(out, true, 40);
  display.expect({{"team, City", "team", 100.0}, {"last", "team", 0.0}});
  display.start(0, 0.0);
  display.update(std::string(200, 'x'), 3.0);
  CHECK(out.str().starts_with("\r\x1b[K[1/2] team, City: 3.0 s"));
  CHECK(out.str().size() == 4 + 39);
}

}  // namespace
}  // namespace km
