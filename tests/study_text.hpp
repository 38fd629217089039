/// Studies as text: refusals with position and message; texts with corrupted bytes.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

/// The message of a study refused as t.toml; empty if it is accepted.
std::string study_refusal(const std::string& text);

/// The study is refused at "t.toml:<place>: " and every one of the words is in the message.
void check_refused(const std::string& text, const std::string& place,
                   const std::vector<std::string>& words);

/// Loaded, or refused in one line with the file's name: any text must give one of the two.
bool loads_or_is_refused(const std::string& text);

/// The same for `trials` texts that have bytes changed, inserted or erased.
void check_damaged(const std::string& text, int trials);

/// The same with any of these values, or none, at any key from `table` on.
void check_exchanged(const std::string& text, const std::string& table,
                     const std::vector<std::string_view>& values);
