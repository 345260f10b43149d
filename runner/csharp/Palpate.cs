// Drives `palpate serve` from C#: one file without other packages, for .NET, Mono and Unity.
//
//   using (var hand = await Palpate.Connect(url, token)) {
//     await hand.Ask("start", "\"stimulus\":\"ball\",\"renderer\":\"ray\"");  // returns once forces are on
//     string trial = await hand.Ask("answer", "\"response\":\"yes\"");        // forces off, on record
//   }
//
// Messages and replies are JSON as protocols/serve.schema.json has it; read replies with the parser of your program, as
// Unity's JsonUtility. Forces stay palpate's. On its own the file is a program:
//   mcs -r:System.Net.Http Palpate.cs && mono Palpate.exe TOKEN_FILE STIMULUS RESPONSE TRIALS

using System;
using System.Collections.Concurrent;
using System.IO;
using System.Net.WebSockets;
using System.Text;
using System.Text.RegularExpressions;
using System.Threading;
using System.Threading.Tasks;

/// <summary>The server refused a message. Code is for programs.</summary>
public sealed class PalpateRefusal : Exception {
  public readonly string Code, Reply;
  public PalpateRefusal(string code, string reply) : base(code + ": " + reply) {
    Code = code;
    Reply = reply;
  }
}

/// <summary>One connection.</summary>
public sealed class Palpate : IDisposable {
  const int AliveEvery = 200;  // ms; the server waits for half a second
  readonly ClientWebSocket socket = new ClientWebSocket();
  readonly SemaphoreSlim sending = new SemaphoreSlim(1);
  readonly CancellationTokenSource gone = new CancellationTokenSource();
  readonly ConcurrentDictionary<long, TaskCompletionSource<string>> waiting =
      new ConcurrentDictionary<long, TaskCompletionSource<string>>();
  long number;

  /// <summary>Events and rows of a stream, as JSON; raised in a thread of the pool.</summary>
  public event Action<string> Told;

  public static async Task<Palpate> Connect(string url, string token, string role = "control") {
    var hand = new Palpate();
    hand.socket.Options.AddSubProtocol("palpate.1");
    await hand.socket.ConnectAsync(new Uri(url), CancellationToken.None).ConfigureAwait(false);
    Start(hand.Read());
    hand.Hello = await hand.Ask("hello", "\"token\":\"" + token + "\",\"version\":1,\"role\":\"" + role + "\"").ConfigureAwait(false);
    if (role == "control") Start(hand.StayAlive());
    return hand;
  }

  static void Start(Task work) {}  // it runs by itself, and keeps its errors

  /// <summary>The answer to hello: what the server said of itself.</summary>
  public string Hello { get; private set; }

  /// <summary>Any message; its reply. Throws PalpateRefusal where it is refused.</summary>
  /// <param name="members">of the message, without braces</param>
  public async Task<string> Ask(string type, string members = "") {
    long id = Interlocked.Increment(ref number);
    var answer = new TaskCompletionSource<string>(TaskCreationOptions.RunContinuationsAsynchronously);
    waiting[id] = answer;
    using (gone.Token.Register(() => answer.TrySetException(new IOException("the server has gone")))) {
      await Send("{\"id\":" + id + ",\"type\":\"" + type + "\"" + (members == "" ? "" : "," + members) + "}").ConfigureAwait(false);
      string reply = await answer.Task.ConfigureAwait(false);
      if (Regex.IsMatch(reply, "^\\{\"re\":\\d+,\"ok\":true")) return reply;
      throw new PalpateRefusal(Regex.Match(reply, "\"code\":\"([^\"]*)\"").Groups[1].Value, reply);
    }
  }

  async Task Send(string text) {
    await sending.WaitAsync().ConfigureAwait(false);  // one message at a time
    try {
      var bytes = new ArraySegment<byte>(Encoding.UTF8.GetBytes(text));
      await socket.SendAsync(bytes, WebSocketMessageType.Text, true, CancellationToken.None).ConfigureAwait(false);
    } finally {
      sending.Release();
    }
  }

  async Task Read() {
    var buffer = new byte[65536];
    try {
      while (true) {
        var text = new MemoryStream();
        WebSocketReceiveResult part;
        do {
          part = await socket.ReceiveAsync(new ArraySegment<byte>(buffer), gone.Token).ConfigureAwait(false);
          if (part.MessageType == WebSocketMessageType.Close) return;
          text.Write(buffer, 0, part.Count);
        } while (!part.EndOfMessage);
        Take(Encoding.UTF8.GetString(text.ToArray()));
      }
    } catch (Exception) {
      // The connection has ended; whoever waits hears it below.
    } finally {
      gone.Cancel();
    }
  }

  void Take(string message) {
    var reply = Regex.Match(message, "^\\{\"re\":(\\d+),");
    TaskCompletionSource<string> answer;
    if (!reply.Success) {
      if (Told != null) Told(message);
    } else if (waiting.TryRemove(long.Parse(reply.Groups[1].Value), out answer)) {
      answer.TrySetResult(message);
    }
  }

  async Task StayAlive() {
    try {
      while (!gone.IsCancellationRequested) {
        await Ask("alive").ConfigureAwait(false);
        await Task.Delay(AliveEvery, gone.Token).ConfigureAwait(false);
      }
    } catch (Exception) {
      gone.Cancel();
    }
  }

  /// <summary>Says goodbye: what is felt stops.</summary>
  public void Dispose() {
    try {
      Ask("bye").Wait(1000);
    } catch (AggregateException) {
      // It has gone already.
    }
    gone.Cancel();
    socket.Dispose();
  }
}

#if !UNITY_5_3_OR_NEWER
/// <summary>A block of trials with one stimulus and one answer, on a terminal.</summary>
static class PalpateTrials {
  static string Member(string json, string name) {
    return Regex.Match(json, "\"" + name + "\":\"?([^\",}]*)").Groups[1].Value;
  }

  static async Task Run(string file, string stimulus, string response, int trials) {
    string serving = File.ReadAllText(file);
    string url = Regex.Match(serving, "\"url\":\"([^\"]*)\"").Groups[1].Value;
    using (var hand = await Palpate.Connect(url, Member(serving, "token"))) {
      for (int done = 0; done < trials;) {
        try {
          await hand.Ask("start", "\"stimulus\":\"" + stimulus + "\"");
          string trial = await hand.Ask("answer", "\"response\":\"" + response + "\"");
          Console.WriteLine(Member(trial, "trial") + " " + Member(trial, "response") + " " + Member(trial, "response_time_s"));
          ++done;
        } catch (PalpateRefusal refusal) {
          if (refusal.Code == "timed-out") {
            ++done;
            continue;
          }
          Console.Error.WriteLine(refusal.Message);
          if (refusal.Code == "emergency") {
            Thread.Sleep(500);  // it is cleared where it was raised, or at the server
          } else if (refusal.Code == "forces-off" || refusal.Code == "stopped" || refusal.Code == "nothing-felt") {
            Console.Error.WriteLine("Look what it was, then press Enter: forces come again.");
            if (Console.ReadLine() == null) throw;
            await hand.Ask("clear");
          } else {
            throw;
          }
        }
      }
    }
  }

  static int Main(string[] words) {
    if (words.Length != 4) {
      Console.Error.WriteLine("usage: Palpate.exe TOKEN_FILE STIMULUS RESPONSE TRIALS");
      return 2;
    }
    Run(words[0], words[1], words[2], int.Parse(words[3])).GetAwaiter().GetResult();
    return 0;
  }
}
#endif
