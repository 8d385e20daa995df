#include <nlohmann/json.hpp>

#include "modules/core/io/json.hpp"
#include "modules/recordings/ros_messages.hpp"
#include "modules/ros_dds/ros_sink.hpp"
#include "test/modules/sensors/euroc_folder.hpp"
#include "test/support/command.hpp"
#include "test/support/euroc_copy.hpp"
#include "test/support/network.hpp"
#include "test/support/process.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

const std::string kDoctor = KM_BIN_DIR "/kimera_multi_doctor";

// "id id " of the findings, in the order of the doctor's JSON.
std::string ids_in(const fs::path& json) {
  const Json result = read_json(json);
  std::string ids;
  for (const auto& finding : result["findings"]) ids += finding["id"].get<std::string>() + ' ';
  return ids;
}

// Runs the doctor on the first seconds of a recording and returns the ids of its findings.
std::string ids_of(const EurocCopy& recording, int expected_exit_code) {
  const TemporaryFolder folder;
  recording.write(folder.path());
  const fs::path json = folder.path() / "out.json";
  const CommandResult run =
      run_command(kDoctor + ' ' + folder.path().string() + " --to 5 --json " + json.string());
  INFO(run.output);
  CHECK(run.exit_code == expected_exit_code);
  return ids_in(json);
}

}  // namespace

TEST_CASE("The doctor finds a recording sound, or names its fault") {
  const auto data = shared_data("euroc/MH_01_easy");
  if (!data) return;
  EurocCopy hall(*data);
  auto& [left, right] = hall.cameras;
  SECTION("sound") {
    CHECK(ids_of(hall, 0).empty());
  }
  SECTION("the cameras' images swapped") {
    std::swap(left, right);
    CHECK(ids_of(hall, 2) == "stereo.swapped ");
  }
  SECTION("no right image at all") {
    for (EurocCopy::Image& image : right) image.file = "/nowhere.png";
    CHECK_THAT(ids_of(hall, 2), StartsWith("recording."));
  }
}

TEST_CASE("The doctor gives the reason why no robot can play a file") {
  const TemporaryFolder folder;
  const auto output_of = [&](const std::string& file) {
    const CommandResult run = run_command(kDoctor + ' ' + (folder.path() / file).string());
    CHECK(run.exit_code == 2);
    return run.output;
  };
  folder.write("world.ply", "ply\nformat ascii 1.0\n");
  CHECK_THAT(output_of("world.ply"), Contains("does not begin like a .bag, .mcap or .db3 file"));
  folder.write("team.jrl", "{}");
  CHECK_THAT(output_of("team.jrl"), Contains("team.jrl: a pose graph, not a recording") &&
                                        Contains("to do: kimera_multi_pgo solve "));
  McapSink record(folder.path() / "record.mcap", [](const std::string& why) { FAIL(why); });
  record.put(record.open({"/rosout", RosLog::kType}), Stamp{1}, encode_ros(RosLog{}));
  record.finish();
  CHECK_THAT(output_of("record.mcap"), Contains("no topic of it has images"));
}

TEST_CASE("The doctor's exit code is 2 for unusable input, with a line that gives the reason") {
  const TemporaryFolder folder;
  const CommandResult empty = run_command(kDoctor + ' ' + folder.path().string());
  CHECK(empty.exit_code == 2);
  CHECK_THAT(empty.output, Contains("recording.refused"));
  for (const char* options :
       {"", "--live x.yaml", ". --network", "/nowhere", ". --from 5 --to 2"}) {
    CAPTURE(options);
    CHECK(run_command(kDoctor + ' ' + options).exit_code == 2);
  }
  CHECK(run_command(kDoctor + " --help").exit_code == 0);
  const CommandResult domain = run_command(kDoctor + " . --domain 7");
  CHECK(domain.exit_code == 2);
  CHECK_THAT(domain.output, Contains("--set ros.domain=N"));
}

TEST_CASE("The doctor listens to the topics of a rig file, and examines their messages") {
  const auto data = shared_data("euroc/MH_01_easy");
  if (!data) return;
  const TemporaryFolder folder;
  const std::string domain = std::to_string(std::random_device()() % 90);
  const Process driver({KM_BIN_DIR "/kimera_multi_publish", data->string(), "--domain", domain,
                        "--interface", "lo"});
  const auto ids = [&](const std::string& left) {
    const fs::path rig = folder.write(
        "rig.yaml", "left: {topic: " + left + "}\nright: {topic: /cam1/image_raw}\n" +
                        "imu: {topic: /imu0}\ncalibration: " + fs::absolute(*data).string() + "\n");
    const fs::path out = folder.path() / "out.json";
    const CommandResult run =
        run_command(kDoctor + " --live " + rig.string() + " --seconds 4 --set ros.interface=lo" +
                    " --set ros.domain=" + domain + " --json " + out.string());
    INFO(run.output);
    REQUIRE(fs::exists(out));
    return ids_in(out);
  };
  CHECK(ids("/left/image_raw") == "live.similar_name ");
  // A busy host loses images, so frames.* and recording.* are allowed.
  const std::string sound = ids("/cam0/image_raw");
  for (const char* part : {"live.", "stereo.", "extrinsics.", "imu."}) {
    CAPTURE(sound, part);
    CHECK(sound.find(part) == sound.npos);
  }
}

namespace {

// The doctor on the network of a host.
class Look {
 public:
  Look(const VirtualNetwork& network, std::vector<std::string> options) {
    const TemporaryFolder folder;
    const std::string out = (folder.path() / "out.json").string();
    std::vector<std::string> command = {kDoctor,     "--network", "--domain", "17",
                                        "--seconds", "1",         "--json",   out};
    command.insert(command.end(), options.begin(), options.end());
    exit_code_ = Process(command, network.host(1)).wait();
    result_ = read_json(out);
  }
  [[nodiscard]] int exit_code() const { return exit_code_; }
  // Ids of warnings and errors.
  [[nodiscard]] std::string ids() const {
    std::string found;
    for (const auto& finding : result_["findings"])
      if (finding["severity"] != "note") found += finding["id"].get<std::string>() + ' ';
    return found;
  }
  // Text of the first finding with this id.
  [[nodiscard]] std::string what(const std::string& id) const {
    for (const auto& finding : result_["findings"])
      if (finding["id"] == id) return finding["what"];
    return "";
  }
  [[nodiscard]] std::string figure(const std::string& name) const {
    for (const auto& figure : result_["figures"])
      if (figure["name"] == name) return figure["value"];
    return "";
  }

 private:
  int exit_code_ = -1;
  Json result_;
};

}  // namespace

TEST_CASE("The doctor finds that multicast does not pass") {
  if (!VirtualNetwork::available()) return;
  const VirtualNetwork network(1);
  const Look sound(network, {});
  CHECK(sound.exit_code() == 0);
  CHECK(sound.ids().empty());
  REQUIRE(Process({"ip", "link", "set", "eth0", "multicast", "off"}, network.host(1)).wait() == 0);
  const Look look(network, {});
  CHECK(look.exit_code() == 2);
  CHECK(look.ids() == "network.multicast ");
}

TEST_CASE("The doctor ends behind a firewall that passes answers only") {
  if (!VirtualNetwork::available()) return;
  const VirtualNetwork network(1);
  for (const char* const rule :
       {"table ip f", "chain ip f i {type filter hook input priority 0; policy drop;}",
        "rule ip f i iifname lo accept", "rule ip f i ct state established,related accept"})
    if (Process(words_of("nft add " + std::string(rule)), network.host(1)).wait() != 0) {
      WARN("nft cannot make a firewall here");
      return;
    }
  const Look look(network, {});
  CHECK(look.exit_code() == 2);
  CHECK(look.ids() == "network.multicast ");
}

TEST_CASE("The doctor finds that a peer is out of reach, or that no robot runs there") {
  if (!VirtualNetwork::available()) return;
  VirtualNetwork network(2);
  const std::string peer = VirtualNetwork::address(2);
  const Look reached(network, {"--peers", peer});
  CHECK(reached.ids() == "network.no_peers ");
  CHECK_THAT(reached.figure("peer " + peer), Contains("0 of 20 lost"));
  network.set_link(2, false);
  const Look lost(network, {"--peers", peer});
  CHECK(lost.exit_code() == 1);
  CHECK_THAT(lost.ids(), Contains("network.unreachable"));
}

TEST_CASE("The doctor states the largest packet that a peer answers") {
  if (!VirtualNetwork::available()) return;
  VirtualNetwork network(2);
  network.set_path_mtu(2, 1280);
  const Look look(network, {"--peers", VirtualNetwork::address(2)});
  CHECK(look.ids() == "network.path_mtu network.no_peers ");
  CHECK_THAT(look.what("network.path_mtu"), Contains("of up to 128") || Contains("of up to 127"));
}

}  // namespace km
