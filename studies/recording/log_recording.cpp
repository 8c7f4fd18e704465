#include <limits>

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
  return streams_.size() - 1;
}

void LogRecording::receive(std::size_t stream, std::string_view bytes) {
  if (counting_) {
    RecordedStream& counted = streams_[stream];
    ++counted.rows;
    if (!times_[stream]) return;
    const double t = times_[stream]->decode(bytes)[0].number;
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
}

void LogRecording::read(const std::vector<RowRequest>& requests, const std::function<void()>& stop) {
  for (auto& consumers : consumers_) consumers.clear();
  for (const RowRequest& request : requests)
    for (std::size_t i = 0; i < streams_.size(); ++i)
      if (streams_[i].name == request.stream)
        consumers_[i].push_back({MessageDecoder(types_[i], MessageEncoding::packed, request.fields), &request});
  scan(stop);
}

}  // namespace tandem
