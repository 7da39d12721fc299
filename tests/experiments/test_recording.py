"""Recordings of runs: their rows are selected and joined."""

from spikeport.experiments.recording import Recording


def test_rows_of_a_recording_can_be_selected_and_recordings_joined():
    recording = Recording.of([(0.0,), (0.1,), (0.2,)])
    assert recording.time_s.tolist() == [0.0, 0.1, 0.2]
    late = recording.where(recording.time_s > 0.05)
    assert late.time_s.tolist() == [0.1, 0.2]
    assert Recording.join([late, recording]).time_s.tolist() == [0.1, 0.2, 0.0, 0.1, 0.2]
