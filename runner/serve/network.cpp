#include "runner/serve/network.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <charconv>
#include <chrono>
#include <cmath>
#include <deque>
#include <limits>
#include <map>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <utility>

#include "runner/serve/loopback.h"
#include "runner/servo/realtime.h"

namespace palpate::runner::serve {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using Code = boost::system::error_code;
using asio::ip::tcp;
using Local = asio::local::stream_protocol;

constexpr auto kHelloPatience = std::chrono::seconds(2);
constexpr std::int64_t kSilence = 500'000'000;                // ns
constexpr auto kStreamEvery = std::chrono::milliseconds(17);  // at most 60 messages a second
constexpr auto kWatchEvery = std::chrono::milliseconds(5);
constexpr std::size_t kMostWatchers = 8;
constexpr std::size_t kMostUnknown = 64;   // connections of a kind before their hello
constexpr int kMostMessages = 200;         // a second; above twice as many the client is closed
constexpr std::size_t kMostWaiting = 256;  // queued replies and events of a client
constexpr std::size_t kMostWaitingBytes = 8 << 20;
/// Bytes a second that belong to no message: frames without contents; one message may be under way.
constexpr std::uint64_t kMostOverhead = kLongestScene + 2 * kLongestMessage;
constexpr std::size_t kMostCommands = 64;  // commands not yet taken by the session
constexpr std::size_t kMostRows = 1024;    // rows in a stream's message
constexpr const char* kSubprotocol = "palpate.1";

std::int64_t now_ns() {
  servo::RealClock clock;
  return clock.now_ns();
}

void add_number(std::string& out, double value) {
  if (!std::isfinite(value)) {
    out += "null";
    return;
  }
  char text[32];
  out.append(text, std::to_chars(text, text + sizeof text, value).ptr);
}

void add_vector(std::string& out, const Vec3& v) {
  for (const int i : {0, 1, 2}) {
    out += ',';
    add_number(out, v[i]);
  }
}

void add_row(std::string& out, const StreamSample& sample, const std::vector<StreamField>& fields) {
  out += '[' + std::to_string(sample.time_ns) + ',' + std::to_string(sample.tick);
  for (const StreamField field : fields) {
    switch (field) {
      case StreamField::tip:
        add_vector(out, sample.tip);
        break;
      case StreamField::tail:
        add_vector(out, sample.tail);
        break;
      case StreamField::force:
        add_vector(out, sample.force);
        break;
      case StreamField::rendered:
        add_vector(out, sample.rendered);
        break;
      case StreamField::contact:
        add_vector(out, sample.contact);
        break;
      case StreamField::depth:
        out += ',';
        add_number(out, sample.depth);
        break;
      case StreamField::object:
        out += ',' + std::to_string(sample.object);
        break;
      case StreamField::faults:
        out += ',' + std::to_string(sample.faults);
        break;
      case StreamField::lateness:
        out += ',' + std::to_string(sample.lateness_ns);
        break;
    }
  }
  out += ']';
}

/// One connection. Belongs to the network's thread.
class Client : public std::enable_shared_from_this<Client> {
 public:
  enum class Role { unknown, control, watch };

  Client(std::uint64_t number, asio::io_context& io) : id(number), hello_timer(io) {}
  virtual ~Client() = default;
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  /// Reads messages until it is closed.
  virtual void begin() = 0;
  virtual void close() = 0;
  /// Bytes that came so far, of messages or not.
  virtual std::uint64_t read_bytes() const { return heard_bytes; }

  /// A client that does not read is disconnected, so that its queue stays bounded.
  void send(std::string text) {
    if (closing_ || closed) return;
    if (waiting_.size() >= kMostWaiting || waiting_bytes_ > kMostWaitingBytes) return close();
    waiting_bytes_ += text.size();
    waiting_.push_back(std::move(text));
    write_next();
  }
  /// Whether no message waits to be written.
  bool idle() const { return waiting_.empty(); }
  void close_after_writing() {
    closing_ = true;
    if (waiting_.empty()) close();
  }

  const std::uint64_t id;
  Role role = Role::unknown;
  bool closed = false;
  asio::steady_timer hello_timer;
  ClientClock clock;
  std::int64_t second_ns = 0;  ///< start of the second in which messages are counted
  int in_second = 0;           ///< messages, pings, empty lines
  std::uint64_t heard_bytes = 0, overhead_before = 0;
  // Stream:
  double rate = 0;  ///< Hz; 0: none
  std::int64_t next_ns = 0;
  std::uint64_t dropped = 0, lost_before = 0;
  std::vector<StreamField> fields;
  std::string rows;  ///< rows that wait for the next message
  std::size_t row_count = 0;

 protected:
  virtual void write(const std::string& text) = 0;
  void written(const Code& error) {
    writing_ = false;
    waiting_bytes_ -= waiting_.front().size();
    waiting_.pop_front();
    if (error) return close();
    if (closing_ && waiting_.empty()) return close();
    write_next();
  }

 private:
  void write_next() {
    if (writing_ || waiting_.empty() || closed) return;
    writing_ = true;
    write(waiting_.front());
  }
  std::deque<std::string> waiting_;
  std::size_t waiting_bytes_ = 0;
  bool writing_ = false, closing_ = false;
};

/// The network's interface for connections.
class Hub {
 public:
  virtual ~Hub() = default;
  virtual void heard(Client& client, const std::string& text) = 0;
  /// Anything that takes time. \return false: it comes too often, close the client
  virtual bool count(Client& client) = 0;
  virtual void gone(Client& client) = 0;
};

/// Counts the bytes that a stream reads.
class CountedBytes {
 public:
  std::uint64_t read() const noexcept { return read_; }

 private:
  friend class beast::rate_policy_access;
  static constexpr std::size_t kAny = std::numeric_limits<std::size_t>::max();
  std::size_t available_read_bytes() const noexcept { return kAny; }
  std::size_t available_write_bytes() const noexcept { return kAny; }
  void transfer_read_bytes(std::size_t size) noexcept { read_ += size; }
  void transfer_write_bytes(std::size_t) noexcept {}
  void on_timer() noexcept {}
  std::uint64_t read_ = 0;
};

class WebClient final : public Client {
 public:
  WebClient(std::uint64_t number, asio::io_context& io, tcp::socket socket, Hub& hub)
      : Client(number, io), hub_(hub), stream_(std::move(socket)) {}

  void accept(const http::request<http::empty_body>& request) {
    stream_.read_message_max(kLongestMessage);
    stream_.control_callback([this](websocket::frame_type kind, beast::string_view) {
      if (kind == websocket::frame_type::close || hub_.count(*this)) return;
      asio::post(stream_.get_executor(), [self = shared_from_this()] { self->close(); });
    });
    stream_.set_option(websocket::stream_base::decorator([](websocket::response_type& response) {
      response.set(http::field::sec_websocket_protocol, kSubprotocol);
    }));
    stream_.async_accept(request, [self = shared_from_this(), this](const Code& error) {
      if (error) return close();
      stream_.text(true);
      begin();
    });
  }
  void begin() override {
    if (closed) return;
    if (role == Role::control) stream_.read_message_max(kLongestScene + kLongestMessage);
    buffer_.consume(buffer_.size());
    stream_.async_read(buffer_, [self = shared_from_this(), this](const Code& error, std::size_t) {
      if (error || closed) return close();
      const auto bytes = buffer_.cdata();
      hub_.heard(*this, {static_cast<const char*>(bytes.data()), bytes.size()});
      begin();
    });
  }
  void close() override {
    if (closed) return;
    closed = true;
    Code ignored;
    stream_.next_layer().socket().shutdown(tcp::socket::shutdown_both, ignored);
    stream_.next_layer().socket().close(ignored);
    hub_.gone(*this);
  }
  std::uint64_t read_bytes() const override { return stream_.next_layer().rate_policy().read(); }

 private:
  void write(const std::string& text) override {
    stream_.async_write(
        asio::buffer(text),
        [self = shared_from_this(), this](const Code& error, std::size_t) { written(error); });
  }
  Hub& hub_;
  // Without compression (false), which this server offers to nobody.
  websocket::stream<beast::basic_stream<tcp, tcp::socket::executor_type, CountedBytes>, false>
      stream_;
  beast::flat_buffer buffer_;
};

class LineClient final : public Client {
 public:
  LineClient(std::uint64_t number, asio::io_context& io, Local::socket socket, Hub& hub)
      : Client(number, io), hub_(hub), socket_(std::move(socket)) {}

  void begin() override {
    if (closed) return;
    const std::size_t most =
        role == Role::control ? kLongestScene + kLongestMessage : kLongestMessage;
    asio::async_read_until(socket_, asio::dynamic_buffer(text_, most), '\n',
                           [self = shared_from_this(), this](const Code& error, std::size_t size) {
                             if (error || closed) return close();
                             std::string line = text_.substr(0, size - 1);
                             text_.erase(0, size);
                             if (!line.empty() && line.back() == '\r') line.pop_back();
                             if (!line.empty())
                               hub_.heard(*this, line);
                             else if (!hub_.count(*this))
                               return close();
                             begin();
                           });
  }
  void close() override {
    if (closed) return;
    closed = true;
    Code ignored;
    socket_.close(ignored);
    hub_.gone(*this);
  }

 private:
  void write(const std::string& text) override {
    line_ = text + '\n';
    asio::async_write(
        socket_, asio::buffer(line_),
        [self = shared_from_this(), this](const Code& error, std::size_t) { written(error); });
  }
  Hub& hub_;
  Local::socket socket_;
  std::string text_, line_;
};

bool offers_subprotocol(const http::request<http::empty_body>& request) {
  for (const auto& field : request) {
    if (field.name() != http::field::sec_websocket_protocol) continue;
    for (const auto& word : http::token_list(field.value()))
      if (word == kSubprotocol) return true;
  }
  return false;
}

}  // namespace

class Network::Impl final : public Hub {
 public:
  explicit Impl(NetworkSettings settings)
      : settings_(std::move(settings)),
        acceptor_(io_),
        local_acceptor_(io_),
        watch_timer_(io_),
        stream_timer_(io_) {
    listen_on_loopback(acceptor_, settings_.port);
    if (!settings_.socket.empty()) listen_local();
  }
  ~Impl() override {
    end();
    if (settings_.socket.empty()) return;
    // Another server may have taken the path after somebody removed this socket.
    struct stat state {};
    if (::lstat(settings_.socket.c_str(), &state) == 0 && state.st_dev == socket_file_.st_dev &&
        state.st_ino == socket_file_.st_ino)
      ::unlink(settings_.socket.c_str());
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  void begin(NetworkHooks hooks) {
    hooks_ = std::move(hooks);
    accept();
    if (!settings_.socket.empty()) accept_local();
    watch();
    stream();
    thread_ = std::thread([this] { io_.run(); });
  }
  void end() {
    if (!thread_.joinable()) return;
    asio::post(io_, [this] {
      for (const auto& [id, client] : std::map(clients_)) client->close();
      io_.stop();
    });
    thread_.join();
  }
  std::uint16_t port() const { return acceptor_.local_endpoint().port(); }

  std::vector<ServeCommand> commands() {
    std::vector<ServeCommand> out;
    const std::lock_guard lock(mutex_);
    out.swap(commands_);
    return out;
  }
  void reply(std::uint64_t client, std::string text) {
    asio::post(io_, [this, client, text = std::move(text)]() mutable {
      const auto found = clients_.find(client);
      if (found != clients_.end()) found->second->send(std::move(text));
    });
  }
  void tell(std::string text) {
    asio::post(io_, [this, text = std::move(text)] { send_to_all(text); });
  }

  /// A flooding client would take all of this thread's time.
  bool count(Client& client) override {
    const std::int64_t now = now_ns();
    if (now - client.second_ns >= 1'000'000'000) {
      client.second_ns = now;
      client.in_second = 0;
      client.overhead_before = overhead(client);
    }
    return ++client.in_second <= 2 * kMostMessages;
  }
  /// Beast passes over empty fragments of a message without a word.
  static std::uint64_t overhead(const Client& client) {
    const std::uint64_t read = client.read_bytes();
    return read > client.heard_bytes ? read - client.heard_bytes : 0;
  }
  void heard(Client& client, const std::string& text) override {
    const std::int64_t now = now_ns();
    client.heard_bytes += text.size();
    if (client.role == Client::Role::control) controller_heard_ns_ = now;
    if (!count(client)) return client.close();
    Message message;
    try {
      message = parse_message(text);
    } catch (const MessageRefused& error) {
      client.send(refused(error.id(), error.why()));
      if (client.role == Client::Role::unknown) client.close_after_writing();
      return;
    }
    const auto refuse = [&](const char* code, const char* why) {
      client.send(refused(message.id, {{code, why, ""}}));
    };
    if (client.role == Client::Role::unknown) {
      if (message.type == MessageType::hello) return welcome(client, message);
      refuse("no-hello", "the first message must be hello");
      return client.close_after_writing();
    }
    if (message.type == MessageType::emergency) {  // bypasses queues and limits
      hooks_.emergency(client.id);
      client.send(accepted(message.id, {{"t_ns", now_ns()}}));
      return send_to_all(event("emergency", now, {{"by", client.id}}));
    }
    if (client.in_second > kMostMessages) return refuse("busy", "at most 200 messages a second");
    answer(client, std::move(message), now);
  }

  void gone(Client& client) override {
    if (client.role == Client::Role::control) {
      if (hooks_.forces_may_come()) {
        hooks_.zero();
        send_to_all(event("controller_gone", now_ns()));  // from now on no force is commanded
      }
      command({client.id, true, {}, true});
    }
    clients_.erase(client.id);
  }

 private:
  void listen_local() {
    try {
      const Local::endpoint place(settings_.socket);
      Local::socket other(io_);
      Code error;
      other.connect(place, error);
      if (!error)
        throw std::runtime_error("--socket " + settings_.socket + ": another server uses it");
      // Remove the socket that a killed server left behind, but no other file.
      struct stat state {};
      if (::lstat(settings_.socket.c_str(), &state) == 0 && S_ISSOCK(state.st_mode))
        ::unlink(settings_.socket.c_str());
      local_acceptor_.open(place.protocol());
      local_acceptor_.bind(place);
      ::chmod(settings_.socket.c_str(), 0600);
      ::lstat(settings_.socket.c_str(), &socket_file_);
      local_acceptor_.listen();
    } catch (const boost::system::system_error& error) {
      const std::string path = std::exchange(settings_.socket, {});
      throw std::runtime_error("--socket " + path + ": " + error.code().message());
    }
  }

  std::shared_ptr<Client> admit(std::shared_ptr<Client> client) {
    clients_[client->id] = client;
    client->hello_timer.expires_after(kHelloPatience);
    client->hello_timer.async_wait([client](const Code& error) {
      if (!error && client->role == Client::Role::unknown) client->close();
    });
    return client;
  }
  /// A newcomer takes the place of the oldest of its kind that has not said hello: a program
  /// without the token cannot keep others out. Both kinds have places of their own: the Unix
  /// socket's belong to the user alone.
  template <class Kind>
  void make_room() {
    std::vector<std::shared_ptr<Client>> unknown;  // the oldest first
    for (const auto& [id, client] : clients_)
      if (client->role == Client::Role::unknown && dynamic_cast<Kind*>(client.get()) != nullptr)
        unknown.push_back(client);
    if (unknown.size() >= kMostUnknown) unknown.front()->close();
  }

  void accept() {
    acceptor_.async_accept([this](const Code& error, tcp::socket socket) {
      if (error == asio::error::operation_aborted) return;
      if (!error) read_request(std::move(socket));
      accept();
    });
  }
  void accept_local() {
    local_acceptor_.async_accept([this](const Code& error, Local::socket socket) {
      if (error == asio::error::operation_aborted) return;
      if (!error) {
        make_room<LineClient>();
        admit(std::make_shared<LineClient>(++newest_, io_, std::move(socket), *this))->begin();
      }
      accept_local();
    });
  }

  /// The request of a connection before it is a WebSocket.
  struct Greeting {
    explicit Greeting(tcp::socket socket) : stream(std::move(socket)) {
      parser.header_limit(8 << 10);
      parser.body_limit(0);
    }
    beast::tcp_stream stream;
    beast::flat_buffer buffer;
    http::request_parser<http::empty_body> parser;
    http::response<http::string_body> response;
  };
  void read_request(tcp::socket socket) {
    Code ignored;
    socket.set_option(tcp::no_delay(true), ignored);
    auto greeting = std::make_shared<Greeting>(std::move(socket));
    std::erase_if(greetings_, [](const auto& other) { return other.expired(); });
    if (greetings_.size() >= kMostUnknown) {
      if (const auto oldest = greetings_.front().lock()) oldest->stream.close();
      greetings_.pop_front();
    }
    greetings_.push_back(greeting);
    greeting->stream.expires_after(kHelloPatience);
    http::async_read(greeting->stream, greeting->buffer, greeting->parser,
                     [this, greeting](const Code& error, std::size_t) {
                       if (!error) greet(greeting);
                     });
  }
  void greet(const std::shared_ptr<Greeting>& greeting) {
    const auto& request = greeting->parser.get();
    const std::string host(request[http::field::host]), origin(request[http::field::origin]);
    if (!is_loopback_name(host))  // a foreign name that resolves to this computer
      return respond(greeting, http::status::forbidden, "Host: expected 127.0.0.1 or localhost\n");
    const std::string own = "http://" + host;
    if (!origin.empty() && origin != own &&
        std::ranges::find(settings_.origins, origin) == settings_.origins.end())
      return respond(greeting, http::status::forbidden,
                     "Origin: this page may not connect; --allow-origin allows it\n");
    if (!websocket::is_upgrade(request)) {
      if (request.target() == "/" && request.method() == http::verb::get)
        return show_page(greeting);
      return respond(greeting, http::status::not_found, "expected a WebSocket, or the page /\n");
    }
    if (!offers_subprotocol(request))
      return respond(greeting, http::status::bad_request, "expected the subprotocol palpate.1\n");
    greeting->stream.expires_never();
    make_room<WebClient>();
    auto client =
        std::make_shared<WebClient>(++newest_, io_, greeting->stream.release_socket(), *this);
    admit(client);
    client->accept(request);
  }
  /// The page does not contain the token: its user needs the whole address.
  void show_page(const std::shared_ptr<Greeting>& greeting) {
    const std::string port = std::to_string(this->port());
    GuardedPage page =
        guarded_page(settings_.page, "ws://127.0.0.1:" + port + " ws://localhost:" + port);
    for (const auto& [name, value] : page.headers) greeting->response.set(name, value);
    respond(greeting, http::status::ok, std::move(page.html), "text/html; charset=utf-8");
  }
  void respond(const std::shared_ptr<Greeting>& greeting, http::status status, std::string body,
               const char* type = "text/plain; charset=utf-8") {
    auto& response = greeting->response;
    response.version(11);
    response.result(status);
    response.set(http::field::content_type, type);
    response.set("X-Content-Type-Options", "nosniff");
    response.keep_alive(false);
    response.body() = std::move(body);
    response.prepare_payload();
    greeting->stream.expires_after(kHelloPatience);
    http::async_write(greeting->stream, response, [greeting](const Code&, std::size_t) {
      Code ignored;
      greeting->stream.socket().shutdown(tcp::socket::shutdown_send, ignored);
    });
  }

  void welcome(Client& client, const Message& message) {
    const auto turn_away = [&](const char* code, const char* why) {
      client.send(refused(message.id, {{code, why, ""}}));
      client.close_after_writing();
    };
    if (!equal_in_constant_time(message.token, settings_.token))
      return turn_away("bad-token", "this is not the server's token");
    std::size_t watchers = 0;
    bool controlled = false;
    for (const auto& [id, other] : clients_) {
      controlled |= other->role == Client::Role::control;
      watchers += other->role == Client::Role::watch ? 1 : 0;
    }
    if (message.control && controlled)
      return turn_away("controlled", "another program controls this server; watch instead");
    if (!message.control && watchers >= kMostWatchers)
      return turn_away("full", "8 programs watch already");
    client.role = message.control ? Client::Role::control : Client::Role::watch;
    if (message.control) controller_heard_ns_ = now_ns();
    client.hello_timer.cancel();
    nlohmann::ordered_json more = {{"version", kServeVersion},
                                   {"program", "palpate " PALPATE_VERSION},
                                   {"client", client.id},
                                   {"t_ns", now_ns()}};
    more.update(hooks_.state());
    client.send(accepted(message.id, more));
  }

  void answer(Client& client, Message message, std::int64_t received_ns) {
    const auto refuse = [&](const char* code, const char* why) {
      client.send(refused(message.id, {{code, why, ""}}));
    };
    switch (message.type) {
      case MessageType::hello:
        return refuse("bad-message", "hello was sent before");
      case MessageType::alive:
        return client.send(accepted(message.id));
      case MessageType::clock: {
        if (!message.t_client.is_null())
          client.clock.take(message.t_client.get<double>(), received_ns, message.seen);
        const std::int64_t sent_ns = now_ns();
        client.clock.answered(sent_ns);
        nlohmann::ordered_json more = {{"t_received_ns", received_ns},
                                       {"t_sent_ns", sent_ns},
                                       {"known", client.clock.is_known(received_ns)}};
        if (!message.t_client.is_null()) more["t_client"] = message.t_client;
        return client.send(accepted(message.id, more));
      }
      case MessageType::subscribe:
        client.rate = message.rate;
        client.fields = std::move(message.fields);
        client.next_ns = 0;
        client.rows.clear();
        client.row_count = 0;
        client.lost_before = hooks_.ticks->lost();
        return client.send(accepted(message.id));
      case MessageType::picture: {
        const std::string members = hooks_.picture();
        return client.send("{\"re\":" + std::to_string(message.id) + ",\"ok\":true," + members +
                           "}");
      }
      case MessageType::bye:
        client.send(accepted(message.id));
        if (client.role == Client::Role::control) {
          client.role = Client::Role::watch;  // a regular end: closing causes no emergency
          command({client.id, true, {}, true});
        }
        return client.close_after_writing();
      default:
        break;
    }
    const bool controls = client.role == Client::Role::control;
    if (!controls && !(message.type == MessageType::clear && hooks_.has_emergency(client.id)))
      return refuse("not-controller", "only the controller may send this");
    message.clock_is_known = client.clock.is_known(received_ns);
    message.times_off = hooks_.times_off();
    const std::int64_t id = message.id;
    if (!command({client.id, false, std::move(message), controls}))
      client.send(refused(id, {{"busy", "64 messages wait for the session already", ""}}));
  }

  bool command(ServeCommand command) {
    {
      const std::lock_guard lock(mutex_);
      if (!command.left && commands_.size() >= kMostCommands) return false;
      commands_.push_back(std::move(command));
    }
    hooks_.wake();
    return true;
  }

  void send_to_all(const std::string& text) {
    for (const auto& [id, client] : std::map(clients_))
      if (client->role != Client::Role::unknown) client->send(text);
  }

  /// Detects a silent controller while forces are on, also one that has said goodbye while the
  /// session's thread is too busy to end them.
  void watch() {
    watch_timer_.expires_after(kWatchEvery);
    watch_timer_.async_wait([this](const Code& error) {
      if (error) return;
      const bool on = hooks_.forces_are_on();
      const std::int64_t now = now_ns();
      for (const auto& [id, client] : std::map(clients_)) {
        if (overhead(*client) > client->overhead_before + kMostOverhead) client->close();
      }
      if (!on) silent_ = false;
      if (on && !silent_ && now - controller_heard_ns_ > kSilence) {
        silent_ = true;
        hooks_.silence();
        send_to_all(event("client_silent", now, {{"since_ns", controller_heard_ns_}}));
      }
      watch();
    });
  }

  void stream() {
    stream_timer_.expires_after(kStreamEvery);
    stream_timer_.async_wait([this](const Code& error) {
      if (error) return;
      StreamSample sample;
      while (hooks_.ticks->next(sample)) {
        for (const auto& [id, client] : clients_) add(*client, sample);
      }
      for (const auto& [id, client] : std::map(clients_)) send_rows(*client);
      stream();
    });
  }
  void add(Client& client, const StreamSample& sample) {
    if (client.rate <= 0) return;
    // Accept ticks half a period early, because their times jitter.
    constexpr double kEveryTick = 1000;  // Hz
    constexpr double kLongest = 1e18;    // ns
    const auto period = static_cast<std::int64_t>(std::min(1e9 / client.rate, kLongest));
    if (client.rate < kEveryTick && sample.time_ns + period / 2 < client.next_ns) return;
    client.next_ns = std::max(client.next_ns + period, sample.time_ns);
    if (client.row_count >= kMostRows) {
      ++client.dropped;
      return;
    }
    if (client.row_count++ > 0) client.rows += ',';
    add_row(client.rows, sample, client.fields);
  }
  /// Rows wait until the client has read the last message; rows beyond the limit are dropped.
  void send_rows(Client& client) {
    const std::uint64_t lost = hooks_.ticks->lost();
    if (client.rate > 0) client.dropped += lost - client.lost_before;
    client.lost_before = lost;
    if ((client.row_count == 0 && client.dropped == 0) || !client.idle()) return;
    client.send("{\"stream\":[" + client.rows + "],\"dropped\":" + std::to_string(client.dropped) +
                "}");
    client.dropped = 0;
    client.rows.clear();
    client.row_count = 0;
  }

  NetworkSettings settings_;
  NetworkHooks hooks_;
  struct stat socket_file_ {};
  asio::io_context io_{1};
  tcp::acceptor acceptor_;
  Local::acceptor local_acceptor_;
  asio::steady_timer watch_timer_, stream_timer_;
  std::map<std::uint64_t, std::shared_ptr<Client>> clients_;
  std::deque<std::weak_ptr<Greeting>> greetings_;  ///< the oldest first
  std::uint64_t newest_ = 0;
  std::int64_t controller_heard_ns_ = 0;
  bool silent_ = false;
  std::mutex mutex_;  ///< guards the next member
  std::vector<ServeCommand> commands_;
  std::thread thread_;
};

bool is_listening(std::uint16_t port) {
  asio::io_context io;
  tcp::socket other(io);
  Code error;
  other.connect({asio::ip::address_v4::loopback(), port}, error);
  return !error;
}

Network::Network(NetworkSettings settings) : impl_(std::make_unique<Impl>(std::move(settings))) {}
Network::~Network() = default;
void Network::begin(NetworkHooks hooks) { impl_->begin(std::move(hooks)); }
void Network::end() { impl_->end(); }
std::uint16_t Network::port() const { return impl_->port(); }
std::vector<ServeCommand> Network::commands() { return impl_->commands(); }
void Network::reply(std::uint64_t client, std::string text) {
  impl_->reply(client, std::move(text));
}
void Network::tell(std::string text) { impl_->tell(std::move(text)); }

}  // namespace palpate::runner::serve
