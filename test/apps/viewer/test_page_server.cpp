#include <arpa/inet.h>
#include <civetweb.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <regex>

#include "apps/viewer/page_server.hpp"
#include "test/apps/viewer/page_listener.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

struct Answer {
  int status = 0;  // 0: the connection was closed without any
  std::string body;
};

int port_of(const PageServer& server) {
  std::smatch found;
  const std::string url = server.url();
  REQUIRE(std::regex_search(url, found, std::regex(":([0-9]+)/")));
  return std::stoi(found[1]);
}

// Path and query of the address of a server.
std::string path_of(const PageServer& server) {
  return server.url().substr(server.url().find('/', std::string("http://").size()));
}

Answer get(int port, const std::string& path, const std::string& headers = {},
           const char* method = "GET") {
  std::array<char, 256> error{};
  const std::string host = headers.find("Host:") == std::string::npos
                               ? "Host: 127.0.0.1:" + std::to_string(port) + "\r\n"
                               : "";
  mg_connection* const connection =
      mg_download("127.0.0.1", port, 0, error.data(), error.size(), "%s %s HTTP/1.1\r\n%s%s\r\n",
                  method, path.c_str(), host.c_str(), headers.c_str());
  if (connection == nullptr) return {};
  Answer answer{mg_get_response_info(connection)->status_code, {}};
  std::array<char, 4096> buffer{};
  for (int n = 0;
       answer.status == 200 && (n = mg_read(connection, buffer.data(), buffer.size())) > 0;)
    answer.body.append(buffer.data(), static_cast<std::size_t>(n));
  mg_close_connection(connection);
  return answer;
}

Answer post(int port, const std::string& path, const std::string& headers = {}) {
  return get(port, path, headers + "Content-Length: 0\r\n", "POST");
}

PageServerOptions any_port() {
  PageServerOptions options;
  options.port = 0;
  options.hello = R"({"kind":"hello"})";
  return options;
}

TEST_CASE("The page and all its parts are served from the program") {
  ViewStore store(1'000'000);
  const PageServer server(store, any_port());
  const int port = port_of(server);
  CHECK(server.url() == "http://127.0.0.1:" + std::to_string(port) + '/');
  CHECK_THAT(get(port, "/").body, StartsWith("<!doctype html>"));
  CHECK(page_files().size() > 10);
  for (const PageFile& file : page_files())
    CHECK(get(port, '/' + std::string(file.path)).body == file.bytes);
  CHECK(get(port, "/none.js").status == 404);
  CHECK(get(port, "/../apps/viewer/main.cpp").status >= 400);
}

TEST_CASE("Pages of other sites are refused") {
  ViewStore store(1'000'000);
  const PageServer server(store, any_port());
  const int port = port_of(server);
  const std::string own = "127.0.0.1:" + std::to_string(port);
  CHECK(get(port, "/", "Origin: http://" + own + "\r\n").status == 200);
  CHECK(get(port, "/", "Origin: http://evil.example\r\n").status == 404);
  for (const std::string host : {"evil.example", "127.evil.example", "127.0.0.1.evil.example"})
    CHECK(get(port, "/", "Host: " + host + ':' + std::to_string(port) + "\r\n").status == 404);
  CHECK(get(port, "/", "Host: localhost:" + std::to_string(port) + "\r\n").status == 200);
  CHECK(get(port, "/updates?page=a").status == 404);  // which need not name the other site
  CHECK(post(port, "/updates?page=a", "Origin: http://evil.example\r\n").status == 404);
}

// A TCP connection of an attacker.
class RawConnection {
 public:
  explicit RawConnection(int port) : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    const timeval patience{.tv_sec = 1, .tv_usec = 0};
    setsockopt(socket_, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof(patience));
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    REQUIRE(::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0);
  }
  ~RawConnection() { ::close(socket_); }
  RawConnection(const RawConnection&) = delete;
  RawConnection& operator=(const RawConnection&) = delete;

  /// False if the server has closed the connection or does not read.
  bool send(const std::string& bytes) const {
    return ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL) > 0;
  }

  /// False once the server has closed the connection.
  [[nodiscard]] bool is_open() const {
    char byte = 0;
    return ::recv(socket_, &byte, 1, MSG_DONTWAIT) < 0 && errno == EAGAIN;
  }

 private:
  int socket_;
};

TEST_CASE("A page waits for a second at most while others send nothing, or byte by byte") {
  ViewStore store(1'000'000);
  const PageServer server(store, any_port());
  const int port = port_of(server);
  std::vector<std::unique_ptr<RawConnection>> idle;
  for (int i = 0; i < 40; ++i) idle.push_back(std::make_unique<RawConnection>(port));
  CHECK(get(port, "/").status == 200);
  CHECK(std::ranges::all_of(idle, [](const auto& connection) { return connection->is_open(); }));
  while (idle.size() < 250) idle.push_back(std::make_unique<RawConnection>(port));
  const std::jthread writer([&](const std::stop_token& stop) {
    for (; !stop.stop_requested(); std::this_thread::sleep_for(std::chrono::milliseconds(100)))
      for (const auto& connection : idle) connection->send("x");
  });
  const auto start = std::chrono::steady_clock::now();
  CHECK(get(port, "/").status == 200);
  CHECK(std::chrono::steady_clock::now() - start < std::chrono::seconds(2));
}

TEST_CASE("Pages beyond the limit are refused, and files are served still") {
  ViewStore store(1'000'000);
  const PageServer server(store, any_port());
  const int port = port_of(server);
  std::vector<std::unique_ptr<PageListener>> pages;
  for (int i = 0; i < 48; ++i) {
    pages.push_back(std::make_unique<PageListener>(port, "/updates?page=" + std::to_string(i)));
    REQUIRE(pages.back()->receives("hello"));
  }
  CHECK(post(port, "/updates?page=48").status == 503);
  CHECK(get(port, "/").status == 200);
}

TEST_CASE("Requests of any size take no memory") {
  ViewStore store(1'000'000);
  const PageServer server(store, any_port());
  const int port = port_of(server);
  const std::string upgrade =
      "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
      "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";
  const auto [start, frame] = GENERATE_COPY(table<std::string, std::string>(
      {{"GET /updates?page=a", upgrade + std::string("\r\n\x81\xff\0\0\0\0\3\0\0\0\0\0\0\0", 16)},
       {"POST /images?page=a&robot=1&on=true", "Content-Length: 2000000000\r\n\r\n"},
       {"POST /updates?page=a", "Content-Length: 2000000000\r\n\r\n"},
       {"GET /", "X: "}}));
  CAPTURE(start);
  const auto peak_kb = [] {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return usage.ru_maxrss;
  };
  const long before = peak_kb();
  const RawConnection attacker(port);
  attacker.send(start + " HTTP/1.1\r\nHost: localhost\r\n" + frame);
  const std::string brackets(1 << 20U, '[');
  for (int k = 0; k < 50 && attacker.send(brackets); ++k) {
  }
  CHECK(peak_kb() - before < 10'000);
  CHECK(get(port, "/").status == 200);
}

TEST_CASE("Other hosts need the token") {
  ViewStore store(1'000'000);
  PageServerOptions options = any_port();
  options.address = "0.0.0.0";
  const PageServer server(store, options), another(store, options);
  const int port = port_of(server);
  const std::string path = path_of(server);
  CHECK(std::regex_match(path, std::regex("/[0-9a-f]{32}/")));
  CHECK(path != path_of(another));
  CHECK_THAT(get(port, path, "Host: robot.example:80\r\n").body, StartsWith("<!doctype html>"));
  CHECK(get(port, "/").status == 404);
  CHECK(get(port, "/main.js").status == 404);
  CHECK(get(port, "/00000000000000000000000000000000/").status == 404);
}

ViewUpdate state_of(const std::string& name) {
  return {3, 1, 0, RobotSample{.name = name}};
}

TEST_CASE("A page receives the hello message, all past messages, and new ones") {
  ViewStore store(1'000'000);
  store.add(state_of("early"));
  const PageServer server(store, any_port());
  PageListener page(port_of(server), "/updates?page=a");
  CHECK(page.receives(R"([{"kind":"hello"}])"));
  CHECK(page.receives(R"("name":"early")"));
  CHECK(page.receives(R"([{"kind":"caught_up"}])"));
  store.add(state_of("later"));
  CHECK(page.receives(R"("name":"later")"));
}

TEST_CASE("A robot is asked for images as long as any page requests them") {
  ViewStore store(1'000'000);
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<std::set<RobotId>> asked;
  PageServerOptions options = any_port();
  options.on_images = [&](const std::set<RobotId>& robots) {
    const std::lock_guard lock(mutex);
    asked.push_back(robots);
    changed.notify_all();
  };
  const auto wait_for = [&](std::size_t count) {
    std::unique_lock lock(mutex);
    return changed.wait_for(lock, kPatience, [&] { return asked.size() >= count; });
  };
  const PageServer server(store, options);
  const int port = port_of(server);
  const auto request = [port](const std::string& page_and_robot) {
    CHECK(post(port, "/images?on=true&page=" + page_and_robot).status == 200);
  };
  {
    const PageListener one(port, "/updates?page=a");
    for (const std::string bad : {"a", "a&robot=-1", "a&robot=70000", "a&robot=3x", "b&robot=3"})
      CHECK(post(port, "/images?on=true&page=" + bad).status == 404);
    request("a&robot=3");
    REQUIRE(wait_for(1));
    {
      const PageListener other(port, "/updates?page=b");
      request("b&robot=3");
      request("b&robot=4");
      REQUIRE(wait_for(2));
    }
    REQUIRE(wait_for(3));  // the other page has gone
  }
  REQUIRE(wait_for(4));
  CHECK(asked == std::vector<std::set<RobotId>>{{3}, {3, 4}, {3}, {}});
}

TEST_CASE("A port that is taken is named") {
  ViewStore store(1000);
  PageServerOptions options = any_port();
  const PageServer server(store, options);
  options.port = port_of(server);
  CHECK_THROWS_WITH(PageServer(store, options),
                    Contains(std::to_string(options.port)) && Contains("--port"));
}

}  // namespace
}  // namespace km
