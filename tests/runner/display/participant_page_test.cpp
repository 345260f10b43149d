#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <numbers>
#include <tuple>
#include <utility>
#include <vector>

#include "runner/display/participant_window.h"
#include "runner/display/window.h"
#include "tests/runner/display/kept_fonts.h"

namespace palpate::runner::display {
namespace {

Page trial_page() {
  Page page;
  page.kind = Page::Kind::neutral;
  page.keys = {{"1", "sphere"}, {"2", "cone"}, {"3", "cylinder"}, {"4", "cube"}};
  return page;
}

/// Rows with pixels other than the background.
int inked_rows(const Image& image) {
  int rows = 0;
  for (int y = 0; y < image.height; ++y) {
    const auto row = image.pixels.begin() + static_cast<std::ptrdiff_t>(y) * image.width;
    rows += std::any_of(row, row + image.width, [](auto p) { return p != ground_colour(); });
  }
  return rows;
}

/// The region of key map and space bar. \param to  share of the height; the bar begins at 0.86
std::vector<std::uint32_t> lower_part(const Image& image, double to = 1) {
  const std::ptrdiff_t from = image.height * 2 / 3;
  const auto end = static_cast<std::ptrdiff_t>(to * image.height);
  return {image.pixels.begin() + from * image.width, image.pixels.begin() + end * image.width};
}

bool border_is_clear(const Image& image) {
  const auto ground = [&](int x, int y) {
    return image.pixels[static_cast<std::size_t>(y) * image.width + x] == ground_colour();
  };
  for (int x = 0; x < image.width; ++x) {
    if (!ground(x, 0) || !ground(x, image.height - 1)) return false;
  }
  for (int y = 0; y < image.height; ++y) {
    if (!ground(0, y) || !ground(image.width - 1, y)) return false;
  }
  return true;
}

/// PALPATE_PAGES=folder keeps the drawn pages for inspection.
void keep(const Image& image, const std::string& name) {
  const char* const folder = std::getenv("PALPATE_PAGES");
  if (folder == nullptr) return;
  std::ofstream out(std::string(folder) + "/" + name + ".ppm", std::ios::binary);
  out << "P6 " << image.width << ' ' << image.height << " 255\n";
  for (const std::uint32_t pixel : image.pixels) {
    for (const int shift : {16, 8, 0}) out.put(static_cast<char>(pixel >> shift & 255U));
  }
}

TEST(ParticipantPage, TheSamePageGivesTheSamePixels) {
  const Image a = draw_page(trial_page(), 1280, 800), b = draw_page(trial_page(), 1280, 800);
  keep(a, "neutral");
  EXPECT_EQ(a.pixels, b.pixels);
  EXPECT_GT(inked_rows(a), 30);
}

TEST(ParticipantPage, MovementShowsHomeTipAndTargetAtGo) {
  Page page;
  page.kind = Page::Kind::neutral;
  page.reach = ReachPicture{.home = {0, -0.04, 0},
                            .target = {0.05, 0.02, 0},
                            .tip = {0, -0.04, 0},
                            .home_radius = 0.005,
                            .target_radius = 0.005,
                            .extent = 0.083};
  const Image before = draw_page(page, 1280, 800);
  page.go = true;
  const Image go = draw_page(page, 1280, 800);
  keep(go, "reach");
  EXPECT_TRUE(border_is_clear(go));
  // The target appears to the right of home and above it.
  double x = 0, y = 0, inked = 0;
  for (int row = 0; row < go.height; ++row) {
    for (int column = 0; column < go.width; ++column) {
      const auto at = static_cast<std::size_t>(row) * go.width + column;
      if (go.pixels[at] == before.pixels[at]) continue;
      x += column;
      y += row;
      ++inked;
    }
  }
  ASSERT_GT(inked, 100);
  // The disc's area gives the scale; its middle is 5 cm to the right of home, in the middle.
  const double scale = std::sqrt(inked / std::numbers::pi) / 0.005;
  EXPECT_NEAR((x / inked - go.width / 2.0) / scale, 0.05, 0.002);
  page.reach->tip = {0.03, -0.02, 0};
  EXPECT_NE(draw_page(page, 1280, 800).pixels, go.pixels);
  page.reach->up = 2;
  EXPECT_NE(draw_page(page, 1280, 800).pixels, go.pixels);
}

TEST(ParticipantPage, ATrialShowsItsWordAndTheKeyMap) {
  Page page = trial_page();
  const Image without = draw_page(page, 1280, 800);
  page.text = "Go";
  page.go = true;
  const Image go = draw_page(page, 1280, 800);
  keep(go, "go");
  EXPECT_NE(go.pixels, without.pixels);
  EXPECT_EQ(lower_part(go), lower_part(without));
  page.text.clear();
  page.keys.clear();
  EXPECT_EQ(inked_rows(draw_page(page, 1280, 800)), 0);
}

TEST(ParticipantPage, LongTextsContinueInTheSameSize) {
  Page page;
  page.kind = Page::Kind::text;
  for (int i = 0; i < 300; ++i) page.text += "Halten Sie den Griffel wie einen Stift. ";
  for (const auto& [width, height] : {std::pair{400, 728}, {1024, 768}, {3840, 2160}}) {
    const int screens = screen_count(page, width, height);
    ASSERT_GT(screens, 1);
    std::vector<std::vector<std::uint32_t>> seen;
    for (int i = 0; i < screens; ++i) {
      const Image image = draw_page(page, width, height, {1, i});
      keep(image, "long" + std::to_string(width) + "-" + std::to_string(i));
      EXPECT_TRUE(border_is_clear(image));
      EXPECT_EQ(std::count(seen.begin(), seen.end(), image.pixels), 0);
      seen.push_back(image.pixels);
    }
    EXPECT_EQ(draw_page(page, width, height, {1, screens}).pixels, seen.back());
  }
  page.text = "short";
  EXPECT_EQ(screen_count(page, 1024, 768), 1);
  page.text = std::string(5000, '\n');
  EXPECT_EQ(screen_count(page, 1024, 768), 1) << "empty screens are left out";
}

TEST(ParticipantPage, ABreakShowsACountDownAndTheProgress) {
  Page page;
  page.text = "Rest your hand.";
  const Image plain = draw_page(page, 1280, 800);
  page.seconds_left = 25;
  const Image counted = draw_page(page, 1280, 800);
  page.seconds_left = 24;
  EXPECT_NE(draw_page(page, 1280, 800).pixels, counted.pixels);
  page.done = 12;
  page.trials = 24;
  const Image far = draw_page(page, 1280, 800);
  keep(far, "break");
  EXPECT_EQ(inked_rows(plain) < inked_rows(counted) && inked_rows(counted) < inked_rows(far), true);
}

TEST(ParticipantPage, AReplyInABreakKeepsAMarginToTheEdge) {
  Page page;
  page.text = "Rest your hand.";
  page.seconds_left = 25;
  page.reply = "This key does nothing now.";
  for (const auto& [width, height] : {std::pair{389, 728}, {1280, 800}}) {
    const Image image = draw_page(page, width, height);
    keep(image, "reply" + std::to_string(width));
    const std::ptrdiff_t edge = static_cast<std::ptrdiff_t>(height / 34) * width;
    EXPECT_TRUE(std::all_of(image.pixels.end() - edge, image.pixels.end(),
                            [](auto p) { return p == ground_colour(); }));
  }
}

// The range stands at its end.
TEST(ParticipantPage, AReplyIsShownWholeInANarrowWindow) {
  for (const auto& [width, height, scale] :
       {std::tuple{310, 560, 1.0}, {620, 800, 2.0}, {1280, 800, 1.0}}) {
    Page page;
    page.kind = Page::Kind::message;
    page.typing = Page::Typing::number;
    page.text = "Wie alt sind Sie?";
    page.reply = "Please type another number: (18 \u2013 99)";
    const Image one = draw_page(page, width, height, {scale, 0});
    page.reply = "Please type another number: (18 \u2013 90)";
    EXPECT_NE(draw_page(page, width, height, {scale, 0}).pixels, one.pixels) << width;
  }
}

TEST(ParticipantPage, AChecklistInANarrowWindowKeepsItsTextSize) {
  Page page;
  page.kind = Page::Kind::checklist;
  page.checklist.steps = {{"Home the device", Checklist::Step::State::done},
                          {"Feel a weak push to the right", Checklist::Step::State::now}};
  for (int i = 0; i < 20; ++i) page.checklist.instruction += "Hold the grip and wait. ";
  const Image image = draw_page(page, 389, 728);
  keep(image, "checklist389");
  EXPECT_TRUE(border_is_clear(image));
  page.checklist.instruction += page.checklist.instruction;
  EXPECT_GT(inked_rows(draw_page(page, 389, 728)), inked_rows(image)) << "more text, more lines";
}

TEST(ParticipantPage, EachStateOfAStepHasAMarkOfDistinctShape) {
  // Colour-blind people can distinguish them too.
  using State = Checklist::Step::State;
  std::vector<std::vector<bool>> shapes;
  std::vector<int> bands;
  for (const State state : {State::to_do, State::now, State::done, State::left_out}) {
    Page page;
    page.kind = Page::Kind::checklist;
    page.checklist.steps = {{"", state}};
    page.checklist.instruction = "Wait";
    const Image image = draw_page(page, 1280, 800);
    std::vector<bool> inked(image.pixels.size());
    std::transform(image.pixels.begin(), image.pixels.end(), inked.begin(),
                   [](auto pixel) { return pixel != ground_colour(); });
    int separate = 0;
    bool before = false;
    for (int y = 0; y < image.height; ++y) {
      const auto row = inked.begin() + static_cast<std::ptrdiff_t>(y) * image.width;
      const bool now = std::find(row, row + image.width, true) != row + image.width;
      separate += now && !before;
      before = now;
    }
    bands.push_back(separate);
    for (const std::vector<bool>& other : shapes) EXPECT_NE(inked, other) << shapes.size();
    shapes.push_back(std::move(inked));
  }
  for (const int separate : bands) EXPECT_EQ(separate, bands[0]) << "a mark is missing";
}

TEST(ParticipantPage, EveryScriptFitsTheScreen) {
  Page page;
  page.kind = Page::Kind::text;
  page.keys = trial_page().keys;
  const std::vector<std::pair<const char*, const char*>> texts = {
      {"english",
       "Hold the stylus like a pen and touch the object. Four shapes may stand before you.\n\nAs "
       "soon "
       "as you know which one it is, press its key. Be accurate first, then quick.\n\nBetween "
       "trials, "
       "take the stylus away from the middle and keep it still for a moment."},
      {"german", "Halten Sie den Griffel wie einen Stift. Größe und Schärfe: äöüß ÄÖÜ."},
      {"greek", "Κρατήστε τη γραφίδα σαν στυλό."},
      {"russian", "Держите щуп как ручку."},
      {"turkish", "Kalemi tutun: ığüşöç İĞÜŞÖÇ."},
      {"arabic", "امسك القلم كما تمسك قلم الكتابة."},
      {"hebrew", "החזיקו את העט כמו עט כתיבה."},
      {"hindi", "स्टाइलस को कलम की तरह पकड़ें।"},
      {"thai", "จับปากกาเหมือนดินสอ"},
      {"japanese", "ペンのように持って、物体に触れてください。"},
  };
  std::vector<std::vector<std::uint32_t>> seen;
  for (const auto& [name, text] : texts) {
    page.text = text;
    const Image image = draw_page(page, 1280, 800);
    keep(image, name);
    EXPECT_TRUE(border_is_clear(image)) << name;
    EXPECT_EQ(std::count(seen.begin(), seen.end(), image.pixels), 0) << name;
    seen.push_back(image.pixels);
  }
}

TEST(ParticipantPage, HostileTextStaysOnTheScreen) {
  Page page;
  page.kind = Page::Kind::text;
  page.keys = trial_page().keys;
  page.text = "short";
  const Image short_text = draw_page(page, 1280, 800);
  const auto keys = lower_part(short_text);
  for (int i = 0; i < 500; ++i) page.text += " long";
  ASSERT_GT(screen_count(page, 1280, 800), 1);
  const auto bar = lower_part(draw_page(page, 1280, 800), 0.86);
  std::string endless;
  for (int i = 0; i < 3000; ++i) endless += "feel ";
  for (const std::string& text :
       {endless, std::string(5000, 'w'), std::string("\xff\xfe broken \xc3"),
        std::string("nul\0inside", 10), std::string(400, '\n')}) {
    page.text = text;
    const Image image = draw_page(page, 1280, 800);
    keep(image, "hostile" + std::to_string(text.size()));
    // A text of several screens is answered on the last one. Beside the space bar is the number of
    // the current screen.
    const bool several = screen_count(page, 1280, 800) > 1;
    EXPECT_EQ(lower_part(image, several ? 0.86 : 1), several ? bar : keys) << text.substr(0, 20);
    EXPECT_TRUE(border_is_clear(image)) << text.substr(0, 20);
  }
  for (int i = 0; i < 40; ++i) page.keys.emplace_back("k", "a shape with quite a long name indeed");
  for (const auto& [width, height] : {std::pair{1, 1}, {40, 30}, {200, 2000}, {3840, 200}}) {
    const Image image = draw_page(page, width, height);
    EXPECT_EQ(image.pixels.size(), static_cast<std::size_t>(width) * height);
  }
}

// Participants must see the whole answer and question: changing any letter of them changes the
// picture.
TEST(ParticipantPage, TheAnswersOfAQuestionAreShownWholeBesideIt) {
  const std::string tail = ", je nachdem, was ich gerade tue, und manchmal auch keine von beiden";
  std::vector<std::vector<std::string>> answers(3);
  for (int i = 0; i < 20; ++i)
    answers[0].push_back("Land Nummer " + std::to_string(i + 1) + " mit langem Namen");
  answers[1] = {"links", "rechts", "beide gleich" + tail};
  for (const char* const step : {"gar nicht", "ein wenig", "mittel", "ziemlich", "sehr",
                                 "au\u00dferordentlich", "unertr\u00e4glich"})
    answers[2].emplace_back(step);
  struct Screen {
    int width, height;
    double ui_scale;
  };
  for (const Screen& screen : {Screen{620, 800, 1},
                               {1280, 800, 1},
                               {800, 600, 1},
                               {640, 480, 1},
                               {1280, 1000, 2},
                               {620, 800, 2},
                               {3840, 2160, 2}}) {
    for (std::size_t list = 0; list < answers.size(); ++list) {
      const auto shown = [&](std::size_t changed) {  // another last letter
        Page page;
        page.kind = Page::Kind::text;
        page.text = "Wie ist es bei Ihne";
        page.text += changed == answers[list].size() ? "m" : "n";
        for (std::size_t i = 0; i < answers[list].size(); ++i) {
          page.keys.emplace_back(std::string(1, static_cast<char>('a' + i)), answers[list][i]);
          if (i == changed) page.keys.back().second.back() = 'W';
        }
        return draw_page(page, screen.width, screen.height, {screen.ui_scale, 0});
      };
      const Image plain = shown(answers[list].size() + 1);
      const std::string name = std::to_string(list) + "-" + std::to_string(screen.width) + "x" +
                               std::to_string(screen.height) + "-" +
                               std::to_string(static_cast<int>(screen.ui_scale));
      keep(plain, "answers" + name);
      EXPECT_TRUE(border_is_clear(plain)) << name;
      for (std::size_t i = 0; i <= answers[list].size(); ++i)
        EXPECT_NE(shown(i).pixels, plain.pixels) << name << ", " << i;
    }
  }
}

TEST(ParticipantPage, OtherKindsOfPagesAreDrawn) {
  Page page;
  page.kind = Page::Kind::feedback;
  page.text = "\u2713";
  for (const auto& [width, height] : {std::pair{389, 728}, {1280, 800}, {1516, 1600}}) {
    const Image feedback = draw_page(page, width, height);
    keep(feedback, "feedback" + std::to_string(width));
    EXPECT_GT(inked_rows(feedback), height / 14) << "seen at a glance";
  }
  page.kind = Page::Kind::message;
  page.text = "A short break. The experimenter will go on with you.";
  const Image message = draw_page(page, 1280, 800);
  keep(message, "message");
  EXPECT_GT(inked_rows(message), 10);
}

TEST(MissingLetters, NamesCharactersThatNoFontHas) {
  EXPECT_EQ(missing_letters({"sphere", "Kugel", "σφαίρα"}), "");
  // A private-use letter, absent from common fonts.
  EXPECT_NE(missing_letters({"sphere", "\xf4\x8f\xbf\xbd"}).find("1 characters"),
            std::string::npos);
  EXPECT_NO_THROW(missing_letters({"\xff\xc3"}));
}

}  // namespace
}  // namespace palpate::runner::display
