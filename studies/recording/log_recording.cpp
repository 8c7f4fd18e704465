#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include <tandem/studies/recording/log_recording.hpp>

namespace tandem {

std::size_t LogRecording::add_stream(const std::string& name, const std::string& type,
                                     std::shared_ptr<const MessageType> message, const std::string& time_field) {
  for (std::size_t i = 0; i < streams_.size(); ++i)
    if (streams_[i].name == name) return i;
  RecordedStream stream{name, type};
  stream.fields = fields_of(*message);
  stream.time_field = time_field;
  streams_.push_back(std::move(stream));
  times_.push_back(time_field.empty()
                       ? nullptr
                       : std::make_unique<MessageDecoder>(message, MessageEncoding::packed, std::vector{time_field}));
  types_.push_back(std::move(message));
  consumers_.emplace_back();
  short_messages_.push_back(0);
  return streams_.size() - 1;
}

void LogRecording::receive(std::size_t stream, std::string_view bytes) {
  try {
    receive_whole(stream, bytes);
  } catch (const OutOfBytes&) {
    ++short_messages_[stream];
  }
}

void LogRecording::receive_whole(std::size_t stream, std::string_view bytes) {
  if (counting_) {
    RecordedStream& counted = streams_[stream];
    const double t = times_[stream] ? times_[stream]->decode(bytes)[0].number : std::nan("");
    ++counted.rows;
    if (std::isnan(t)) return;
    if (!(counted.first <= t)) counted.first = t;
    if (!(counted.last >= t)) counted.last = t;
    return;
  }
  for (Consumer& consumer : consumers_[stream])
    consumer.request->row({std::numeric_limits<double>::quiet_NaN(), consumer.decoder.decode(bytes)});
}

void LogRecording::count_rows() {
  counting_ = true;
  scan([] {});
  counting_ = false;
  report_short_messages();
}

void LogRecording::report_short_messages() {
  for (std::size_t i = 0; i < streams_.size(); ++i)
    if (const std::size_t n = std::exchange(short_messages_[i], 0); n > 0)
      add_defect(fmt::format("{}: {} messages are shorter than their format; they are dropped", streams_[i].name, n));
}

void LogRecording::read(const std::vector<RowRequest>& requests, const std::function<void()>& stop) {
  for (auto& consumers : consumers_) consumers.clear();
  for (const RowRequest& request : requests)
    for (std::size_t i = 0; i < streams_.size(); ++i)
      if (streams_[i].name == request.stream)
        consumers_[i].push_back({MessageDecoder(types_[i], MessageEncoding::packed, request.fields), &request});
  scan(stop);
  report_short_messages();
}

}  // namespace tandem
