-- wrk's script: every request is a play of one of 1,000 players.
wrk.method = "POST"
wrk.headers["Content-Type"] = "application/json"
request = function()
  return wrk.format(nil, nil, nil, '{"player":"player-' .. math.random(1000) .. '"}')
end
done = function(summary, latency)
  local errors = summary.errors.status + summary.errors.connect + summary.errors.read + summary.errors.write
  io.write(string.format("figures %d %d %d %d\n", summary.requests, summary.duration, latency:percentile(99), errors))
end
