from spikeport.robot.estimator.simulated_sensors import SimulatedSensors
from spikeport.robot.estimator.truth import Truth
from spikeport.robot.plant import Plant


def test_the_truth_is_the_state_of_the_plant_not_of_the_sensors():
    plant = Plant()
    truth, sensors = Truth(lambda: plant.state), SimulatedSensors(plant).read()
    assert (truth.reset(sensors).base_position == plant.data.qpos[:3]).all()
    plant.step()
    assert (truth.update(sensors).base_position == plant.data.qpos[:3]).all()
