"""``spikeport doctor``: installed packages, and the commands that install missing ones."""


def test_doctor_lists_installed_versions(spikeport):
    done = spikeport("doctor")
    assert (done.code, done.err) == (0, "")
    assert "nengo-loihi" in done.out
    assert "1.1.0" in done.out


def test_doctor_names_the_command_that_installs_a_missing_package(spikeport, monkeypatch):
    from spikeport.commands import doctor

    found = doctor.version_of
    monkeypatch.setattr(
        doctor, "version_of", lambda name: None if name == "xarray" else found(name)
    )
    done = spikeport("doctor")
    assert done.code == 0
    (row,) = (line for line in done.out.splitlines() if "xarray" in line)
    assert row.split() == ["xarray", "missing", "extra", "runs"]
    assert done.out.endswith(
        "to install everything that is missing: pip install 'spikeport[runs]'\n"
    )


def test_doctor_fails_if_something_required_is_missing(spikeport, monkeypatch):
    from spikeport.commands import doctor

    monkeypatch.setattr(doctor, "version_of", lambda name: None if name == "numpy" else "1")
    done = spikeport("doctor")
    assert done.code == 1
    assert done.out.endswith("to install everything that is missing: pip install spikeport\n")


def test_doctor_lists_the_packages_of_the_metadata_but_not_development_tools():
    from spikeport.commands.doctor import packages

    found = packages()
    assert {"nengo": "", "jinja2": "", "mujoco": "robot", "torch": "train"}.items() <= found.items()
    assert not {"pytest", "ruff", "spikeport"} & found.keys()
