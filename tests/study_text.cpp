#include "tests/study_text.hpp"

#include <cstdlib>
#include <random>

#include "study/study.hpp"
#include "tests/check.hpp"
#include "tests/files.hpp"

using namespace tiltrim;

std::string study_refusal(const std::string& text) {
  return refusal<StudyError>([&] { (void)parse_study(text, "t.toml"); });
}

// For tests/study_schema.py, into the folder that TILTRIM_REFUSED names.
static void keep(const std::string& message, const std::string& text) {
  static int number = 0;
  const char* folder = std::getenv("TILTRIM_REFUSED");
  if (folder && text.size() < 10'000)
    set_contents(fmt::format("{}/{:05}.toml", folder, ++number), message + "\n" + text);
}

void check_refused(const std::string& text, const std::string& place,
                   const std::vector<std::string>& words) {
  const std::string message = study_refusal(text);
  keep(message, text);
  CAPTURE(text.substr(0, 300));
  CAPTURE(message);
  CHECK(message.starts_with("t.toml:" + place + ": "));
  for (const std::string& word : words) {
    CAPTURE(word);
    CHECK(message.find(word) != std::string::npos);
  }
}

bool loads_or_is_refused(const std::string& text) {
  try {
    return !parse_study(text, TILTRIM_SOURCE_DIR "/studies/t.toml").conditions.empty();
  } catch (const StudyError& e) {
    const std::string message = e.what();
    return message.find("t.toml:") != std::string::npos && message.size() < 2000;
  }
}

void check_damaged(const std::string& text, int trials) {
  std::mt19937 random(20131120);
  constexpr std::string_view likely =
      "\n\r\t \"'#=.,[]{}-+_0123456789eEaVxX:\\\x80\xC3\xEF\xFF\x01";
  for (int trial = 0; trial < trials; ++trial) {
    CAPTURE(trial);
    std::string changed = text;
    const std::size_t at = random() % text.size();
    const char byte = trial % 2 ? likely[random() % likely.size()] : char(random() % 256);
    switch (random() % 3) {
      case 0:
        changed[at] = byte;
        break;
      case 1:
        changed.insert(at, 1, byte);
        break;
      default:
        changed.erase(at, 1 + random() % 8);
    }
    if (!loads_or_is_refused(changed)) FAIL("neither loaded nor refused");
  }
}

void check_exchanged(const std::string& text, const std::string& table,
                     const std::vector<std::string_view>& values) {
  for (std::size_t at = text.find(table); (at = text.find(" = ", at)) != std::string::npos;
       at += 3) {
    const std::size_t end = text.find('\n', at), begin = text.rfind('\n', at);
    std::vector<std::string> changed{text.substr(0, begin) + text.substr(end)};
    for (const std::string_view value : values)
      changed.push_back(text.substr(0, at + 3) + std::string(value) + text.substr(end));
    for (const std::string& other : changed) {
      CAPTURE(other);
      if (!loads_or_is_refused(other)) FAIL("neither loaded nor refused");
    }
  }
}
